"""Another program's grid as a line map (paper, VIII: 'postprocessing grid maps')."""
