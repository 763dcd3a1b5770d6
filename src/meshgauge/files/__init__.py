"""Files of any kind: which a run reads, and how one is written, whole or not at all. Standard library only."""
