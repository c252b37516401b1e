# Cross-building for ARM (aarch64) with Debian's packages of both architectures: docs/arm.md.
# Code generators (fastddsgen, Java) are those of the host; headers and libraries come from multi-arch packages.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
# `ctest` and add_custom_command start built programs through it where binfmt_misc does not.
find_program(SLS_QEMU_AARCH64 NAMES qemu-aarch64 qemu-aarch64-static)
if(SLS_QEMU_AARCH64)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${SLS_QEMU_AARCH64})
endif()
