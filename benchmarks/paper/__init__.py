"""The paper's experiments through the whole path: Table I, Figs. 2 to 6 and Acc, written to docs/paper-experiments.md."""
