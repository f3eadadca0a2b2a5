// The ARAP term, edges in SIMD lanes. The formulas are those of backends/shared/lm_arap.hpp.
#include "backends/cpu/lm_edges.hpp"

#include <numeric>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/lm_edges.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

#include "backends/cpu/surface_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {

using D = hn::CappedTag<float, kLanes>;
using V = hn::Vec<D>;
using L3 = Lanes3<V>;

struct EdgeLanes {
    V wa, wb;  // rotations' real parts; b's in the hemisphere of a's
    L3 qa, qb;
    L3 relative;  // imaginary part of qa qb*
    L3 now, turned_a, turned_b;
    V length, stretch, cost;
    V by_length, by_angle, by_rotation;
};

HWY_INLINE EdgeLanes measure(const EdgeTask& task, size_t at) {
    const D d;
    const hn::Rebind<int32_t, D> di;
    const LmEdges& edges = *task.edges;
    EdgeLanes e;
    const auto a = hn::ShiftLeft<3>(hn::Load(di, edges.a.data() + at)),
               b = hn::ShiftLeft<3>(hn::Load(di, edges.b.data() + at));
    const auto gather = [&](auto index, size_t field)
                            HWY_ATTR { return hn::GatherIndex(d, task.poses + field, index); };
    e.wa = gather(a, 0);
    e.qa = {gather(a, 1), gather(a, 2), gather(a, 3)};
    const V wb = gather(b, 0);
    const L3 qb{gather(b, 1), gather(b, 2), gather(b, 3)};
    const L3 along = subtract(L3{gather(b, 4), gather(b, 5), gather(b, 6)},
                              L3{gather(a, 4), gather(a, 5), gather(a, 6)});

    const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    const V sign =
        hn::IfThenElse(hn::Lt(hn::MulAdd(e.wa, wb, dot(e.qa, qb)), zero), hn::Neg(one), one);
    e.wb = hn::Mul(sign, wb);
    e.qb = scale(sign, qb);
    e.relative = subtract(subtract(scale(e.wb, e.qa), scale(e.wa, e.qb)), cross(e.qa, e.qb));
    const V length = hn::Sqrt(dot(along, along));
    e.length = hn::Max(length, hn::Set(d, float(kMinLengthMm)));
    e.now = scale(hn::Div(one, e.length), along);
    e.stretch = hn::Sub(length, hn::Load(d, edges.length.data() + at));
    const L3 rest = load_lanes(d, edges.direction_x.data() + at, edges.direction_y.data() + at,
                               edges.direction_z.data() + at);
    e.turned_a = rotate(e.wa, e.qa, rest);
    e.turned_b = rotate(e.wb, e.qb, scale(hn::Neg(one), rest));

    const V weight = hn::Load(d, edges.weight.data() + at);
    e.by_length = hn::Mul(weight, hn::Set(d, task.length_weight));
    e.by_angle = hn::Mul(weight, hn::Set(d, task.angle_weight));
    e.by_rotation = hn::Mul(weight, hn::Set(d, task.rotation_weight));
    const L3 ab = subtract(e.turned_a, e.now), ba = add(e.turned_b, e.now),
             turn = subtract(e.qa, e.qb);
    const V turn_w = hn::Sub(e.wa, e.wb);
    const V twice = hn::MulAdd(e.by_length, hn::Mul(e.stretch, e.stretch),
                               hn::Mul(e.by_rotation, hn::MulAdd(turn_w, turn_w, dot(turn, turn))));
    e.cost =
        hn::MulAdd(hn::Set(d, 2.0f), twice, hn::Mul(e.by_angle, hn::Add(dot(ab, ab), dot(ba, ba))));
    return e;
}

// The couplings that the block between the edge's control points and their own blocks are made of.
struct Couplings {
    V lever_a[9], lever_b[9];  // [turned]x (I - now now^T) angle / length, row-major
    V shift[6];                // of the difference of the translations, upper triangle
};
HWY_INLINE Couplings couple(const EdgeLanes& e) {
    const D d;
    Couplings c;
    const V lever = hn::Div(e.by_angle, e.length);
    const auto fill = [&](const L3& turned, V* out) HWY_ATTR {
        const L3 t = scale(lever, turned), side = cross(t, e.now),
                 zero{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
        const V skew[9] = {zero.x,       hn::Neg(t.z), t.y, t.z,   zero.x,
                           hn::Neg(t.x), hn::Neg(t.y), t.x, zero.x};
        const V s[3] = {side.x, side.y, side.z}, n[3] = {e.now.x, e.now.y, e.now.z};
        for (size_t r = 0; r < 3; ++r)
            for (size_t k = 0; k < 3; ++k)
                out[3 * r + k] = hn::NegMulAdd(s[r], n[k], skew[3 * r + k]);
    };
    fill(e.turned_a, c.lever_a);
    fill(e.turned_b, c.lever_b);
    const V bend = hn::Div(hn::Add(lever, lever), e.length);
    const V along = hn::MulSub(hn::Set(d, 2.0f), e.by_length, bend);
    const L3 n = scale(along, e.now);
    const V values[6] = {hn::MulAdd(n.x, e.now.x, bend), hn::Mul(n.x, e.now.y),
                         hn::Mul(n.x, e.now.z),          hn::MulAdd(n.y, e.now.y, bend),
                         hn::Mul(n.y, e.now.z),          hn::MulAdd(n.z, e.now.z, bend)};
    for (size_t i = 0; i < 6; ++i) c.shift[i] = values[i];
    return c;
}

// Stores count (a multiple of 4) components of all lanes; lane i's component c is then at (c / 4 *
// lanes + i)
// * 4 + c % 4.
HWY_INLINE void interleave(const V* components, size_t count, float* out) {
    const D d;
    for (size_t c = 0; c < count; c += 4)
        hn::StoreInterleaved4(components[c], components[c + 1], components[c + 2],
                              components[c + 3], d, out + c * hn::Lanes(d));
}

// The block of rows a and columns b, row-major: that is b's row and a's column, column-major, as
// the lower half stores it.
HWY_INLINE void between(const EdgeLanes& e, const Couplings& c, float* out) {
    const D d;
    const V half = hn::Mul(hn::Set(d, -0.5f), e.by_rotation);
    // qa qb* = (w, t): the coupling of the rotations is w I + [t]x
    const V w = hn::MulAdd(e.wa, e.wb, dot(e.qa, e.qb));
    const L3& t = e.relative;
    const V coupling[9] = {w, hn::Neg(t.z), t.y, t.z, w, hn::Neg(t.x), hn::Neg(t.y), t.x, w};
    constexpr size_t kUpper[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
    V block[36];
    for (size_t r = 0; r < 3; ++r)
        for (size_t k = 0; k < 3; ++k) {
            block[6 * r + k] = hn::Mul(half, coupling[3 * r + k]);
            block[6 * r + 3 + k] = hn::Neg(c.lever_a[3 * r + k]);
            block[6 * (3 + r) + k] = hn::Neg(c.lever_b[3 * k + r]);
            block[6 * (3 + r) + 3 + k] = hn::Neg(c.shift[kUpper[3 * r + k]]);
        }
    interleave(block, 36, out);
}

// The part of one of an edge's control points, whose direction of rest is turned.
HWY_INLINE void own(const EdgeLanes& e, const L3& turned, const V* lever, const V* shift,
                    const L3& turn_gradient, const L3& shift_gradient, float* out) {
    const D d;
    V values[kNodeFloats];
    const V base = hn::MulAdd(hn::Set(d, 0.5f), e.by_rotation, e.by_angle);
    const L3 t = scale(e.by_angle, turned);
    values[0] = hn::NegMulAdd(t.x, turned.x, base);
    values[1] = hn::Neg(hn::Mul(t.x, turned.y));
    values[2] = hn::Neg(hn::Mul(t.x, turned.z));
    values[3] = hn::NegMulAdd(t.y, turned.y, base);
    values[4] = hn::Neg(hn::Mul(t.y, turned.z));
    values[5] = hn::NegMulAdd(t.z, turned.z, base);
    for (size_t i = 0; i < 9; ++i) values[6 + i] = lever[i];
    for (size_t i = 0; i < 6; ++i) values[15 + i] = shift[i];
    const V gradient[7] = {turn_gradient.x,  turn_gradient.y,  turn_gradient.z, shift_gradient.x,
                           shift_gradient.y, shift_gradient.z, hn::Zero(d)};
    for (size_t i = 0; i < 7; ++i) values[21 + i] = gradient[i];
    interleave(values, kNodeFloats, out);
}

HWY_INLINE void add_own(const float* values, size_t lane, size_t lanes, float* node) {
    const hn::FixedTag<float, 4> d4;
    for (size_t c = 0; c < kNodeFloats; c += 4)
        hn::StoreU(hn::Add(hn::LoadU(d4, node + c), hn::Load(d4, values + c * lanes + 4 * lane)),
                   d4, node + c);
}

// The part of one control point in consecutive edges.
struct OwnSum {
    hn::Vec<hn::FixedTag<float, 4>> sum[kNodeFloats / 4];

    HWY_INLINE OwnSum() {
        for (auto& part : sum) part = hn::Zero(hn::FixedTag<float, 4>());
    }
    HWY_INLINE void add(const float* values, size_t lane, size_t lanes) {
        const hn::FixedTag<float, 4> d4;
        for (size_t c = 0; c < kNodeFloats / 4; ++c)
            sum[c] = hn::Add(sum[c], hn::Load(d4, values + 4 * c * lanes + 4 * lane));
    }
    HWY_INLINE void move_to(float* node) {
        const hn::FixedTag<float, 4> d4;
        for (size_t c = 0; c < kNodeFloats / 4; ++c) {
            hn::StoreU(hn::Add(hn::LoadU(d4, node + 4 * c), sum[c]), d4, node + 4 * c);
            sum[c] = hn::Zero(d4);
        }
    }
};

double SumEdges(const EdgeTask& task) {
    const D d;
    const size_t lanes = hn::Lanes(d), last = task.piece->last;
    const LmEdges& edges = *task.edges;
    const hn::FixedTag<float, 4> d4;
    OwnSum sum_b;
    float* const nodes = task.nodes - task.piece->first_node * kNodeFloats;
    int32_t present = edges.b[task.piece->first];
    HWY_ALIGN float block[36 * kLanes], node_a[kNodeFloats * kLanes], node_b[kNodeFloats * kLanes];
    double cost = 0;
    for (size_t at = task.piece->first; at < last; at += lanes) {
        const EdgeLanes e = measure(task, at);
        cost += double(hn::GetLane(hn::SumOfLanes(d, e.cost)));
        if (!task.linearise) continue;

        const Couplings c = couple(e);
        between(e, c, block);
        const L3 turn = scale(e.by_rotation, e.relative);
        const L3 turn_a = subtract(turn, scale(e.by_angle, cross(e.turned_a, e.now)));
        const L3 turn_b = subtract(scale(e.by_angle, cross(e.turned_b, e.now)), turn);
        const L3 lean = subtract(e.turned_b, e.turned_a);
        const V lever = hn::Div(e.by_angle, e.length);
        const V along = hn::NegMulAdd(lever, dot(lean, e.now),
                                      hn::Mul(hn::Mul(hn::Set(d, 2.0f), e.by_length), e.stretch));
        const L3 pull = add(scale(along, e.now), scale(lever, lean));
        own(e, e.turned_a, c.lever_a, c.shift, turn_a, scale(hn::Set(d, -1.0f), pull), node_a);
        own(e, e.turned_b, c.lever_b, c.shift, turn_b, pull, node_b);

        for (size_t i = 0; i < std::min(lanes, last - at); ++i) {
            float* out = task.lower + size_t(edges.block[at + i]) * kBlockFloats;
            for (size_t k = 0; k < 36; k += 4)
                hn::Store(hn::Load(d4, block + k * lanes + 4 * i), d4, out + k);
            add_own(node_a, i, lanes, nodes + size_t(edges.a[at + i]) * kNodeFloats);
            if (edges.b[at + i] != present) {
                sum_b.move_to(nodes + size_t(present) * kNodeFloats);
                present = edges.b[at + i];
            }
            sum_b.add(node_b, i, lanes);
        }
    }
    if (task.linearise) sum_b.move_to(nodes + size_t(present) * kNodeFloats);
    return cost;
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace defrec::cpu {

HWY_EXPORT(SumEdges);
double sum_edges(const EdgeTask& task) { return HWY_DYNAMIC_DISPATCH(SumEdges)(task); }

LmEdges::LmEdges(const LmTemplate& surface, const LowerPattern& pattern, const Host& host)
    : a(HostAllocator<int32_t>(host)),
      b(HostAllocator<int32_t>(host)),
      direction_x(HostAllocator<float>(host)),
      direction_y(HostAllocator<float>(host)),
      direction_z(HostAllocator<float>(host)),
      length(HostAllocator<float>(host)),
      share(HostAllocator<float>(host)),
      weight(padded(surface.edges.size()), HostAllocator<float>(host)),
      block(HostAllocator<uint32_t>(host)),
      count(surface.edges.size()),
      pieces(HostAllocator<LmEdgePiece>(host)) {
    std::vector<size_t> order(count);
    std::iota(order.begin(), order.end(), size_t{0});
    std::sort(order.begin(), order.end(), [&](size_t x, size_t y) {
        return std::pair(surface.edges[x].b, surface.edges[x].a) <
               std::pair(surface.edges[y].b, surface.edges[y].a);
    });
    for (size_t i = 0; i < padded(count); ++i) {
        const size_t at = order[std::min(i, count - 1)];
        const defrec_edge& edge = surface.edges[at];
        const Vec3<double>& direction = surface.rest_direction[at];
        a.push_back(edge.a);
        b.push_back(edge.b);
        direction_x.push_back(float(direction.x));
        direction_y.push_back(float(direction.y));
        direction_z.push_back(float(direction.z));
        length.push_back(float(surface.rest_length[at]));
        share.push_back(float(kArapShare * double(edge.weight) / surface.mean_degree));
        block.push_back(uint32_t(pattern.find(b.back(), a.back())));
    }
    cut();
}

void LmEdges::cut() {
    constexpr size_t kMinEdges = 512, kMaxPieces = 16;
    const size_t pieces_wanted = std::clamp<size_t>(count / kMinEdges, 1, kMaxPieces),
                 each = padded((count + pieces_wanted - 1) / pieces_wanted);
    for (size_t first = 0; first < count; first += each) {
        const size_t last = std::min(count, first + each);
        const size_t low = size_t(*std::min_element(&a[first], &a[first] + (last - first))),
                     end = size_t(b[last - 1]) + 1;
        pieces.push_back({first, last, low, end, piece_nodes});
        piece_nodes += end - low;
    }
}

}  // namespace defrec::cpu
#endif
