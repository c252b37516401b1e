#include "common/config/scenario.hpp"
