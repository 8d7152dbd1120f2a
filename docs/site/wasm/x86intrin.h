// SPDX-License-Identifier: MIT
// What simdjson's code for SSE 4.2 needs beyond the intrinsics that Emscripten has for WebAssembly.
#pragma once
#include <nmmintrin.h>

// The carry-less product of the low half of `bits` and ones alone, the only one that is asked for: each bit
// is the parity of those up to it. The high half is not computed.
inline __m128i _mm_clmulepi64_si128(__m128i bits, __m128i /*ones*/, int /*low halves*/) {
    auto parity = static_cast<unsigned long long>(_mm_cvtsi128_si64(bits));
    for (int shift = 1; shift < 64; shift *= 2)
        parity ^= parity << shift;
    return _mm_set_epi64x(0, static_cast<long long>(parity));
}

inline long long _popcnt64(long long bits) {
    return __builtin_popcountll(static_cast<unsigned long long>(bits));
}
