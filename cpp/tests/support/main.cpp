// Boost.Test and its main, compiled once for all tests.
#define BOOST_TEST_MODULE sidestep
#include <boost/test/included/unit_test.hpp>
