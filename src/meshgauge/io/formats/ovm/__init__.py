"""OpenVolumeMesh, text and binary."""
