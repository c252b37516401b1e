# sls_add_wire_types(LIBRARY NAME): the static library of the C++ types of NAME.idl and their serialisation, in the build
# tree only. Headers: NAME.h and NAMEPubSubTypes.h. No type announces a TypeObject: in Fast DDS 2.9 one crashes peers
# that do not know the type (Fast-DDS #3296).
function(sls_add_wire_types library name)
  set(generated ${CMAKE_CURRENT_BINARY_DIR}/generated)
  file(MAKE_DIRECTORY ${generated})
  # fastddsgen 4.0 computes no size of a sequence whose bound is the name of a constant, so the number takes its place.
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${name}.idl)
  file(READ ${name}.idl text)
  string(REGEX MATCHALL "const unsigned long [A-Z_]+ = [0-9]+" constants "${text}")
  foreach(constant IN LISTS constants)
    string(REGEX REPLACE "const unsigned long ([A-Z_]+) = ([0-9]+)" "\\1;\\2" constant "${constant}")
    list(GET constant 0 constant_name)
    list(GET constant 1 number)
    string(REGEX REPLACE ", *${constant_name}>" ", ${number}>" text "${text}")
  endforeach()
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${name}.idl CONTENT "${text}" @ONLY)
  if(sls_fastdds_version EQUAL 2)
    set(sources ${generated}/${name}.cxx ${generated}/${name}PubSubTypes.cxx)
    set(headers ${generated}/${name}.h ${generated}/${name}PubSubTypes.h)
  else()
    set(options -no-typeobjectsupport)
    set(sources ${generated}/${name}PubSubTypes.cxx)
    set(headers ${generated}/${name}.hpp ${generated}/${name}PubSubTypes.hpp ${generated}/${name}CdrAux.hpp
                ${generated}/${name}CdrAux.ipp)
    file(CONFIGURE OUTPUT ${generated}/${name}.h CONTENT "#include \"${name}.hpp\"\n")
    file(CONFIGURE OUTPUT ${generated}/${name}PubSubTypes.h CONTENT "#include \"${name}PubSubTypes.hpp\"\n")
  endif()
  # Without -t it writes /tmp/NAME.idl.cc, which two builds at once or another user's build may hold.
  add_custom_command(
    OUTPUT ${sources} ${headers}
    COMMAND ${FASTDDSGEN} -replace -cs ${options} -t ${CMAKE_CURRENT_BINARY_DIR} -d ${generated}
            ${CMAKE_CURRENT_BINARY_DIR}/${name}.idl
    DEPENDS ${CMAKE_CURRENT_BINARY_DIR}/${name}.idl
    WORKING_DIRECTORY ${generated}
    COMMENT "Generating the wire types of ${name}.idl")
  add_library(${library} STATIC ${sources})
  target_include_directories(${library} SYSTEM PUBLIC $<BUILD_INTERFACE:${generated}>)
  target_include_directories(${library} PUBLIC "$<BUILD_INTERFACE:${sls_fastdds_includes}>")
  target_link_libraries(${library} PUBLIC ${sls_fastdds_target} fastcdr)
  target_compile_options(${library} PRIVATE -w)  # generated code warns
endfunction()
