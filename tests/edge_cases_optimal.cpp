// docs/edge_cases.md, the tables of optimal weights.
#include "edge_cases.hpp"
#include <mis/optimal.hpp>
