// SPDX-License-Identifier: MIT
// Floor 0: packets of numbers as the scalar T of the heuristics, throughputs, biased densities and the
// recursion (not of complete paths): a std::experimental::simd, an xsimd batch, or an Eigen array of fixed
// size. Each lane gets the weight that its numbers have alone. Include it before a packet is used.
//
//     using lanes = std::experimental::fixed_size_simd<float, 8>;
//     const mis::path_weights weigh{mis::power, mis::bidirectional(lanes(pixels))};
//
// Unlike a scalar, packets of floats are weighed in float, with the accuracy that densities in double have,
// and end_point::hittable is a mask. Under -ffast-math a lane may have NaN for a weight where its own density
// is infinite, or overflows; a scalar has 0 or 1 there.
//
// None of the three libraries is included. A packet is what compares to a mask instead of a bool. The mask
// has .select and .any (Eigen), or beside it there are where and any_of (std::experimental), or select and
// any (xsimd); so any other packet that has these is one as well. Its numbers' type is value_type, or Value
// (Dr.Jit).
#pragma once

#include <mis/config.hpp>
#include <utility>

namespace mis::detail {

namespace packets {

template <class T>
using comparison = std::decay_t<decltype(std::declval<const T&>() < std::declval<const T&>())>;

// What the libraries call the two operations, in the order of preference. Inlined by order: left to itself, a
// compiler calls the one that chooses, and packets go through memory.
struct third {};
struct second : third {};
struct first : second {};
void where(), select(), any_of(), any(); // ours are not looked for, only those beside the packet

template <class M, class T>
MIS_DETAIL_INLINE auto choose(first, const M& mask, const T& yes, const T& no)
    -> decltype(T(mask.select(yes, no))) {
    return mask.select(yes, no);
}
template <class M, class T>
MIS_DETAIL_INLINE auto choose(second, const M& mask, const T& yes, T no) -> decltype(where(mask, no), T(no)) {
    where(mask, no) = yes;
    return no;
}
template <class M, class T>
MIS_DETAIL_INLINE auto choose(third, const M& mask, const T& yes, const T& no)
    -> decltype(T(select(mask, yes, no))) {
    return select(mask, yes, no);
}
template <class M> MIS_DETAIL_INLINE auto is_any(first, const M& mask) -> decltype(bool(mask.any())) {
    return mask.any();
}
template <class M> MIS_DETAIL_INLINE auto is_any(second, const M& mask) -> decltype(bool(any_of(mask))) {
    return any_of(mask);
}
template <class M> MIS_DETAIL_INLINE auto is_any(third, const M& mask) -> decltype(bool(any(mask))) {
    return any(mask);
}

// Masks as objects: Eigen's comparisons are expressions.
template <class M, class = void> struct object { using type = M; };
template <class M> struct object<M, std::void_t<typename M::PlainObject>> {
    using type = typename M::PlainObject;
};

template <class T, class = void> struct number { using type = typename T::value_type; };
template <class T> struct number<T, std::void_t<typename T::Value>> { using type = typename T::Value; };

} // namespace packets

template <class T> struct lanes<T, std::enable_if_t<!std::is_convertible_v<packets::comparison<T>, bool>>> {
    using scalar = typename packets::number<T>::type;
    using mask = typename packets::object<packets::comparison<T>>::type;

    template <class M> MIS_DETAIL_INLINE static T select(const M& condition, const T& yes, const T& no) {
        return packets::choose(packets::first(), condition, yes, no);
    }
    template <class M> MIS_DETAIL_INLINE static bool any(const M& condition) {
        return packets::is_any(packets::first(), condition);
    }
};

} // namespace mis::detail
