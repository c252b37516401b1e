# Adds the packages of the libraries that the programs link to those of CPACK_DEBIAN_PACKAGE_DEPENDS. With
# CPACK_DEBIAN_PACKAGE_SHLIBDEPS, CPack would start two programs for each of the 560 files to find the linked ones,
# which takes most of its time.
file(GLOB_RECURSE files ${CPACK_TEMPORARY_DIRECTORY}/usr/*)
set(linked)
foreach(file IN LISTS files)
  if(NOT IS_SYMLINK ${file})
    file(READ ${file} magic LIMIT 4 HEX)
    if(magic STREQUAL 7f454c46)
      list(APPEND linked ${file})
    endif()
  endif()
endforeach()
set(folder ${CPACK_TOPLEVEL_DIRECTORY}/dependencies)  # dpkg-shlibdeps expects a source package
file(WRITE ${folder}/debian/control "")
file(MAKE_DIRECTORY ${CPACK_TEMPORARY_DIRECTORY}/DEBIAN)  # and this beside what it reads
execute_process(COMMAND dpkg-shlibdeps --ignore-missing-info -O ${linked} WORKING_DIRECTORY ${folder}
                OUTPUT_VARIABLE said OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
file(REMOVE_RECURSE ${CPACK_TEMPORARY_DIRECTORY}/DEBIAN)
if(NOT said MATCHES "^shlibs:Depends=(.+)$")
  message(FATAL_ERROR "dpkg-shlibdeps: expected shlibs:Depends=…, got '${said}'")
endif()
string(APPEND CPACK_DEBIAN_PACKAGE_DEPENDS ", ${CMAKE_MATCH_1}")
