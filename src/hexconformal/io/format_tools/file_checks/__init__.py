"""What is looked for in a file, and in those that it names, before a reader that it could crash or overcome gets it."""
