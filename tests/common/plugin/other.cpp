extern "C" void sls_test_is_other() {}
