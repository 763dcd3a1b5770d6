"""Surface cells: triangles, quadrilaterals, polygons, straight or curved, in a plane or in space."""
