# This room adds to the lists that Makefile.am describes.
