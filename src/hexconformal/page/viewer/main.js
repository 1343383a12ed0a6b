// Opens the page: reads what it holds, and shows it.

import { ColorManagement } from "three";

import { h } from "./dom.js";
import { Mesh } from "./mesh/mesh.js";
import { Page } from "./page.js";
import style from "./style.css";

ColorManagement.enabled = false; // colours are shown as the maps have them

async function open() {
  const sheet = h("style", {}, style);
  document.head.append(sheet);
  try {
    const contents = JSON.parse(document.getElementById("contents").textContent);
    const page = new Page(await Mesh.of(contents));
    window.hexconformal = page; // for scripts and tests
    document.documentElement.dataset.ready = "yes";
  } catch (problem) {
    const gl = document.createElement("canvas").getContext("webgl2");
    const why = gl ? String(problem) : "this browser does not draw in three dimensions (WebGL 2 is off)";
    document.body.replaceChildren(h("p", { class: "failed" }, `The page cannot be shown: ${why}`));
    throw problem;
  }
}

open();
