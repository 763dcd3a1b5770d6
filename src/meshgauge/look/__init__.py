"""How results look: bands, colours, numbers. Data for every output; nothing here is measured or printed."""
