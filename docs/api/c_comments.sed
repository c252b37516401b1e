# Plain comments of a C header as Doxygen's: that of the file, those before a declaration, those behind one.
1s#^/\* (.*)#/** @file\n * \1#
s#^( *)/\* #\1/** #
s#([^ ] +)/\* #\1/**< #
