# Finds Fast DDS 2 (2.9 to 2.14) or 3 with the Fast CDR and the code generator that belong to it. Stops with one line if
# they do not fit together. Sets sls_fastdds_version, sls_fastdds_target, FASTDDSGEN and sls_fastdds_includes, the folders
# here with what differs in C++: version2 or version3, fastcdr1 or fastcdr2.
set(SLS_FASTDDS "" CACHE STRING "Major version of Fast DDS, 2 or 3; empty: 3 if it is installed, else 2")
if(NOT SLS_FASTDDS MATCHES "^[23]?$")
  message(FATAL_ERROR "SLS_FASTDDS: expected 2, 3 or nothing, got '${SLS_FASTDDS}'")
endif()
find_program(FASTDDSGEN fastddsgen)

if(NOT SLS_FASTDDS EQUAL 2)
  find_package(fastdds 3 CONFIG QUIET)
endif()
if(fastdds_FOUND)
  set(sls_fastdds_version 3)
  set(sls_fastdds_target fastdds)
  set(header fastdds/config.hpp)
elseif(NOT SLS_FASTDDS EQUAL 3)
  find_package(fastrtps 2.9 CONFIG QUIET)
  set(sls_fastdds_version 2)
  set(sls_fastdds_target fastrtps)
  set(header fastrtps/config.h)
endif()
if(NOT (fastdds_FOUND OR fastrtps_FOUND))
  set(found ${fastrtps_CONSIDERED_VERSIONS} ${fastdds_CONSIDERED_VERSIONS})
  if(NOT found)
    set(found nothing)
  endif()
  message(FATAL_ERROR "Fast DDS: expected fastrtps 2.9 (Debian 12: libfastrtps-dev) or fastdds 3 (Debian 13: "
                      "libfastdds-dev), got ${found}")
endif()
set(version ${${sls_fastdds_target}_VERSION})
set(place ${${sls_fastdds_target}_DIR})
string(TOUPPER ${sls_fastdds_target} macro)
if(fastdds_FOUND)
  # Not by find_package: its targets would come beside those of version 3.
  find_file(other fastrtps-config.cmake NO_CACHE
            PATH_SUFFIXES lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/fastrtps lib/cmake/fastrtps share/fastrtps/cmake)
  if(other)
    message(STATUS "Fast DDS: found ${version} in ${place} and an earlier one in ${other}; takes ${version} "
                   "(-DSLS_FASTDDS=2 takes the other)")
  endif()
endif()

# The headers that the compiler finds, fastcdr and the generator must be of this version.
find_package(fastcdr CONFIG REQUIRED)
if(fastcdr_VERSION VERSION_LESS 2)
  set(sls_fastcdr_version 1)
else()
  set(sls_fastcdr_version 2)
endif()
set(content "#include <${header}>
#include <fastcdr/config.h>
static_assert(${macro}_VERSION_MAJOR == ${sls_fastdds_version}, \"${header} is of another version\");
")
if(sls_fastdds_version EQUAL 3)
  string(APPEND content "static_assert(FASTCDR_VERSION_MAJOR == 2, \"fastcdr 2 is needed\");\n")
else()
  string(APPEND content "#if __has_include(<fastdds/config.hpp>)\n#error headers of version 3 come first\n#endif\n")
endif()
set(checked "${version} ${place} ${FASTDDSGEN}")
if(NOT SLS_FASTDDS_CHECKED STREQUAL checked)
  try_compile(fits SOURCE_FROM_CONTENT check.cpp "${content}int main() {}\n"
              LINK_LIBRARIES ${sls_fastdds_target} fastcdr OUTPUT_VARIABLE said NO_CACHE)
  if(NOT fits)
    string(REGEX MATCH "(error|undefined|cannot find)[^\n]*" reason "${said}")
    message(FATAL_ERROR "Fast DDS ${version} in ${place}: its headers and libraries do not fit together: ${reason}")
  endif()
  math(EXPR expected "${sls_fastcdr_version} + 1")  # fastddsgen 3 is of the Fast DDS 2 that uses Fast CDR 2
  if(sls_fastdds_version EQUAL 3)
    set(expected 4)
  endif()
  if(FASTDDSGEN)
    execute_process(COMMAND ${FASTDDSGEN} -version OUTPUT_VARIABLE said ERROR_VARIABLE said)
  endif()
  string(REGEX MATCH "version [0-9.]+" generator "${said}")
  if(NOT generator MATCHES "version ${expected}\\.")
    message(FATAL_ERROR "Fast DDS ${version} in ${place}: expected fastddsgen of version ${expected}, "
                        "got ${FASTDDSGEN} ${generator}")
  endif()
  set(SLS_FASTDDS_CHECKED "${checked}" CACHE INTERNAL "what has been found to fit together")
endif()
message(STATUS "Fast DDS: takes ${version} in ${place}")
set(sls_fastdds_includes ${CMAKE_CURRENT_LIST_DIR}/version${sls_fastdds_version}
                         ${CMAKE_CURRENT_LIST_DIR}/fastcdr${sls_fastcdr_version})
