// What stage lm sees of the surface: points, landmarks and patches that the same control points
// move, side by side for SIMD, and the sums over each such group. A group's sums are computed by
// one thread in one order; only then are groups added, in their order.
#pragma once
#include "backends/cpu/blend_clusters.hpp"
#include "backends/definition/lm_inputs.hpp"
#include "backends/shared/levenberg_marquardt.hpp"
#include "backends/shared/lm_terms.hpp"

namespace defrec::cpu {

constexpr size_t kJacobian = 6 * kBlendNodes;  // entries of a row
// Few groups have more than 8 points or 8 sightings: wider vectors would be mostly empty.
constexpr size_t kGroupLanes = 8;
// Rows of the linearised system come in fours (lm_normal_equations-inl.hpp).
constexpr size_t kRowFloats = kJacobian + 4, kFourRows = 4 * kRowFloats;

struct LmGroup {
    std::array<int32_t, kBlendNodes> node;
    uint32_t first_point, points;
    // Sightings of the present frame, matches before patches; room for landmarks + patches.
    uint32_t first_sighting, sightings, matches;
    uint32_t first_landmark, landmarks, first_patch, patches;  // in landmark_order, patch_order
};

// The parts of a group's normal equations, for its own control points: blocks (k, l), k >= l, in
// the order (0,0) (1,0) (1,1) (2,0) ...
struct LmGroupSums {
    static constexpr size_t kPairs = kBlendNodes * (kBlendNodes + 1) / 2;
    float blocks[kPairs][36];  // column-major
    float gradient[kJacobian];
    float data[kBlendNodes];  // weight of the data at each control point
    struct Term {
        float cost, weights, squares;
        int32_t count;
    } icp, match, patch;
    float missing;
};

// The control point of a row of the system is the group's member-th.
struct RowGroup {
    uint32_t group, member;
};

class LmGroups {
  public:
    // Components of points and of sightings: component c of item i is at c * stride + i.
    enum {
        kX,
        kY,
        kZ,
        kNormalX,
        kNormalY,
        kNormalZ,
        kWeight,
        kFirst = kWeight + int(kBlendNodes),  // BlendWeights::first
        kPointComponents
    };
    enum {
        kSeenX,
        kSeenY,
        kSeenZ,
        kSeenWeight,
        kSeenFirst = kSeenWeight + int(kBlendNodes),
        kSeenU,
        kSeenV,
        kSeenUU,
        kSeenUV,
        kSeenVV,
        kSeenDepth,
        kSeenRoot,
        kTermWeight,
        kInverseA,
        kInverseC2,
        kPxInverseC2,
        kIsPatch,
        kSightingComponents
    };

    LmGroups(const LmTemplate& surface, const Host& host);

    // Gathers the frame's matches and patch observations of groups first .. last - 1.
    void set_frame(const defrec_lm_params& params, const LmFrame& frame, size_t first, size_t last);

    std::span<const LmGroup> groups() const { return groups_; }
    const float* point(int component) const {
        return points_.data() + size_t(component) * point_stride_;
    }
    const float* sighting(int component) const {
        return sightings_.data() + size_t(component) * sighting_stride_;
    }
    size_t places() const { return point_stride_; }  // of points, those that fill vectors included
    size_t max_rows() const { return max_rows_; }    // of a group, those without weight included

  private:
    // Position, weights and BlendWeights::first of a landmark or patch.
    using Place = std::array<float, 4 + kBlendNodes>;
    void store_sighting(size_t at, const Place& place, const Sighting<float>& seen, float weight,
                        float inverse_a, float inverse_c2, float px_inverse_c2);
    void pad_sightings(LmGroup& group);

    HostVector<LmGroup> groups_;
    HostVector<float> points_, sightings_;
    HostVector<uint32_t> landmark_order_, patch_order_;
    HostVector<Place> landmark_places_, patch_places_;  // in these orders
    size_t point_stride_ = 0, sighting_stride_ = 0, max_rows_ = 0;
};

struct LmGroupTask {
    const LmGroups* groups;
    const NodeMotion* motions;
    const defrec_lm_params* params;
    DisparityImage image;
    bool linearise;     // blocks, gradients and data too
    float* scratch;     // lm_scratch_floats(groups)
    int32_t* offsets;   // of each point: where it last was in the disparity image, bytes
    LmGroupSums* sums;  // one per group
};
size_t lm_scratch_floats(const LmGroups& groups);
// Computes the sums of groups first .. last - 1.
void sum_groups(const LmGroupTask& task, size_t first, size_t last);

// Where each block of a group belongs: in the system's lower half, or the control point's own one.
using GroupPlaces = std::array<uint32_t, LmGroupSums::kPairs>;

struct LmRowTask {
    std::span<const RowGroup> entries;  // the groups that share in a row
    const LmGroup* groups;
    const LmGroupSums* sums;
    const GroupPlaces* places;
    float *lower, *diagonal;  // of the system
    float* gradient;          // of the row
};
// Adds the groups' sums to a row, in their order.
void add_groups(const LmRowTask& task);

}  // namespace defrec::cpu
