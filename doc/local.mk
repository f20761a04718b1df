# See the lists in Makefile.am.
