"""The rig as things to print, cut and buy; all but `cad` is plain Python and NumPy."""
