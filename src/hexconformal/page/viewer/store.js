// What the user has chosen, in one place; whoever depends on it is told which choices changed.

export function createStore(initial) {
  let state = { ...initial };
  const listeners = [];
  return {
    get state() {
      return state;
    },
    set(changes) {
      const changed = new Set(Object.keys(changes).filter((key) => !Object.is(state[key], changes[key])));
      if (changed.size === 0) return;
      state = { ...state, ...changes };
      for (const listener of listeners) listener(changed, state);
    },
    subscribe(listener) {
      listeners.push(listener);
    },
  };
}
