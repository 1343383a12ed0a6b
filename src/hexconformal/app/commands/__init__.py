"""The commands of the program, a module each: what can be asked, and what is done."""
