"""LS-DYNA keyword files."""
