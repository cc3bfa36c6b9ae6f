"""How alike a solid texture and its exemplar are: docs/evaluation.md."""
