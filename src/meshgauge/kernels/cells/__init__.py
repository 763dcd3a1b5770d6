"""Node and cell values of the four shapes: the fast pass, the exact sign where rounding could decide, the fold."""
