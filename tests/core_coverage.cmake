# Counters in the cores and in what calls them. Everything else is that of the ordinary build, also in the compiler's
# cache. Included by core_coverage.py.
function(sls_count_branches)
  foreach(target IN ITEMS sls_client sls_judgement sls_record sls_server_core sls_sim sls_sync sls_world sls_worlds
                          sls_test_headers sync_test client_core_test recorder_core_test server_core_test
                          fault_line_test)
    target_compile_options(${target} PRIVATE -O1 -fprofile-instr-generate -fcoverage-mapping)
  endforeach()
  target_link_options(sls_sync INTERFACE -fprofile-instr-generate)
  target_link_options(fault_line_test PRIVATE -fprofile-instr-generate)
endfunction()
cmake_language(DEFER CALL sls_count_branches)
