// A translation unit for the precompiled headers of tests/CMakeLists.txt.
