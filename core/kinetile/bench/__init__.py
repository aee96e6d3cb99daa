"""How fast broad phases are: measured on scenes of the thesis, compared with what the thesis says."""
