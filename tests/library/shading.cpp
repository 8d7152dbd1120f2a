#include <mis/mis.hpp>

double next_event_weight(double p_light, double p_bsdf) { return mis::power(p_light, p_bsdf); }
