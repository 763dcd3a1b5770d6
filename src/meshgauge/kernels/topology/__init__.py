"""Half-faces and their mates, connected components, coincident points."""
