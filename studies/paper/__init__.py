"""The paper's printed numbers beside ours, and a page that shows it all; files are read, nothing is solved."""
