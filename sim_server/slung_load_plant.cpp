#include "sim_server/slung_load_plant.hpp"
