"""The page of one browser: what it draws, its panels, what lies over its picture. Needs viser."""
