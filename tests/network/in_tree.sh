#!/bin/sh
# in_tree.sh TREE BUILD PROGRAM ARGUMENTS…: runs the program of that name in BUILD/bin with the loader and the libraries
# of TREE, the root folder of another Debian. Everything else is this machine's: files, processes, network.
tree=$1 build=$2 name=$(basename "$3")
shift 3
libraries=$(find "$tree/usr/lib" -mindepth 1 -maxdepth 1 -name '*-linux-gnu')
# Its usual name in Debian 12, usr/lib64/…, is an absolute link, which would lead to this machine's loader.
exec "$(find "$libraries" -maxdepth 1 -name 'ld-linux-*')" --library-path "$libraries" "$build/bin/$name" "$@"
