// Needs a function of a newer system's C library.
extern "C" double sls_test_function_of_the_future(double x);
extern "C" double sls_test_value();
extern "C" double sls_test_value() { return sls_test_function_of_the_future(1.0); }
