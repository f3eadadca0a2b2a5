// Distances of corners to stronger ones near them for the stage orb.
#include "backends/cpu/orb_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/orb_distance.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void near_distances(const OrbCells& cells, uint32_t row, uint8_t* distances) {
    const hn::ScalableTag<int16_t> d;
    const hn::Rebind<uint8_t, decltype(d)> d8;
    constexpr ptrdiff_t kRim = ptrdiff_t(kOrbRim);
    for (size_t column = 0; column < cells.cells_x; column += hn::Lanes(d)) {
        const size_t own = row * cells.stride + column;
        const auto x = hn::LoadU(d, cells.x + own), y = hn::LoadU(d, cells.y + own),
                   score = hn::LoadU(d, cells.score + own);
        const auto just_above = hn::Add(score, hn::Set(d, int16_t{1}));
        auto nearest = hn::Set(d, int16_t{orb::kFarthest});
        for (ptrdiff_t dy = -kRim; dy <= kRim; ++dy)
            for (ptrdiff_t dx = -kRim; dx <= kRim; ++dx) {
                const ptrdiff_t other = ptrdiff_t(own) + dy * ptrdiff_t(cells.stride) + dx;
                const bool earlier = dy < 0 || (dy == 0 && dx < 0);
                const auto weaker =
                    hn::Lt(hn::LoadU(d, cells.score + other), earlier ? score : just_above);
                const auto away = hn::Max(hn::Abs(hn::Sub(hn::LoadU(d, cells.x + other), x)),
                                          hn::Abs(hn::Sub(hn::LoadU(d, cells.y + other), y)));
                nearest = hn::IfThenElse(weaker, nearest, hn::Min(nearest, away));
            }
        nearest = hn::IfThenElseZero(hn::Gt(score, hn::Zero(d)), nearest);
        hn::StoreU(hn::DemoteTo(d8, nearest), d8, distances + column);
    }
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(near_distances);
void orb_near_distances(const OrbCells& cells, uint32_t row, uint8_t* distances) {
    HWY_DYNAMIC_DISPATCH(near_distances)(cells, row, distances);
}

}  // namespace defrec::cpu
#endif
