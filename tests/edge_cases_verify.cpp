// docs/edge_cases.md, the tables of verification.
#include "edge_cases.hpp"
#include <mis/verify.hpp>
