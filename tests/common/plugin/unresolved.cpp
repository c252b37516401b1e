extern "C" int sls_test_defined_nowhere();
extern "C" int sls_test_calls_it() { return sls_test_defined_nowhere(); }
