// The C library of a system that is newer than any: only to be linked.
extern "C" double sls_test_function_of_the_future(double x);
extern "C" double sls_test_function_of_the_future(double x) { return x; }
