"""What formats share: text and binary parsing, cells from faces, merging, isolation, atomic writes."""
