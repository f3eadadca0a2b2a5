// Groups of the surface, and a frame's sightings sorted into them.
#include "backends/cpu/lm_groups.hpp"

namespace defrec::cpu {
namespace {

enum List : uint32_t { kPoint, kLandmark, kPatch };

std::vector<BlendKey> sorted_keys(const LmTemplate& surface) {
    std::vector<BlendKey> keys;
    const auto add = [&](const auto& items, List list) {
        for (size_t i = 0; i < items.size(); ++i)
            keys.push_back({BlendWeights(items[i]).node, list, uint32_t(i)});
    };
    add(surface.points, kPoint);
    add(surface.landmarks, kLandmark);
    add(surface.patches, kPatch);
    std::sort(keys.begin(), keys.end());
    return keys;
}

}  // namespace

LmGroups::LmGroups(const LmTemplate& surface, const Host& host)
    : groups_(HostAllocator<LmGroup>(host)),
      points_(HostAllocator<float>(host)),
      sightings_(HostAllocator<float>(host)),
      landmark_order_(HostAllocator<uint32_t>(host)),
      patch_order_(HostAllocator<uint32_t>(host)),
      landmark_places_(HostAllocator<Place>(host)),
      patch_places_(HostAllocator<Place>(host)) {
    const std::vector<BlendKey> keys = sorted_keys(surface);
    std::vector<uint32_t> source;  // of each place for a point
    for (size_t i = 0; i < keys.size(); ++i) {
        if (i == 0 || keys[i].node != keys[i - 1].node) {
            source.resize(padded(source.size(), kGroupLanes), source.empty() ? 0 : source.back());
            groups_.push_back({keys[i].node, uint32_t(source.size()), 0, 0, 0, 0,
                               uint32_t(landmark_order_.size()), 0, uint32_t(patch_order_.size()),
                               0});
        }
        LmGroup& group = groups_.back();
        if (keys[i].list == kPoint) source.push_back(keys[i].index), ++group.points;
        const auto place = [](const auto& item) {
            const BlendWeights blend_weights(item);
            return Place{item.position[0],        item.position[1],
                         item.position[2],        blend_weights.weight[0],
                         blend_weights.weight[1], blend_weights.weight[2],
                         blend_weights.weight[3], float(blend_weights.first)};
        };
        if (keys[i].list == kLandmark) {
            landmark_order_.push_back(keys[i].index), ++group.landmarks;
            landmark_places_.push_back(place(surface.landmarks[keys[i].index]));
        }
        if (keys[i].list == kPatch) {
            patch_order_.push_back(keys[i].index), ++group.patches;
            patch_places_.push_back(place(surface.patches[keys[i].index]));
        }
    }
    source.resize(padded(source.size(), kGroupLanes), source.empty() ? 0 : source.back());

    point_stride_ = source.size();
    points_.assign(size_t(kPointComponents) * point_stride_, 0.0f);
    for (size_t i = 0; i < source.size(); ++i) {
        const defrec_surface_point& point = surface.points[source[i]];
        const BlendWeights blend_weights(point);
        for (size_t c = 0; c < 3; ++c) {
            points_[(kX + c) * point_stride_ + i] = point.position[c];
            points_[(kNormalX + c) * point_stride_ + i] = point.normal[c];
        }
        for (size_t k = 0; k < kBlendNodes; ++k)
            points_[(kWeight + k) * point_stride_ + i] = blend_weights.weight[k];
        points_[size_t(kFirst) * point_stride_ + i] = float(blend_weights.first);
    }

    for (LmGroup& group : groups_) {
        group.first_sighting = uint32_t(sighting_stride_);
        const size_t room = padded(group.landmarks + group.patches, kGroupLanes);
        sighting_stride_ += room;
        max_rows_ = std::max(max_rows_, padded(group.points, kGroupLanes) + 3 * room);
    }
    sightings_.assign(size_t(kSightingComponents) * sighting_stride_, 0.0f);
}

void LmGroups::store_sighting(size_t at, const Place& place, const Sighting<float>& seen,
                              float weight, float inverse_a, float inverse_c2,
                              float px_inverse_c2) {
    const auto set = [&](int component, float value) {
        sightings_[size_t(component) * sighting_stride_ + at] = value;
    };
    static_assert(kSeenX == 0 && kSeenWeight == 3 && size_t(kSeenU) == Place().size());
    for (int c = 0; c < int(place.size()); ++c) set(c, place[size_t(c)]);
    const float values[] = {seen.u,    seen.v,     seen.uu,       seen.uv,
                            seen.vv,   seen.depth, seen.root,     weight,
                            inverse_a, inverse_c2, px_inverse_c2, px_inverse_c2 > 0 ? 1.0f : 0.0f};
    for (int c = 0; c < int(std::size(values)); ++c) set(kSeenU + c, values[c]);
}

void LmGroups::set_frame(const defrec_lm_params& params, const LmFrame& frame, size_t first,
                         size_t last) {
    const float match_c2 = 1 / (params.match_tukey_mm * params.match_tukey_mm);
    const float patch_c2 = 1 / (params.patch_tukey_px * params.patch_tukey_px);
    const float ramp = constants_of(params).match_slope;
    for (LmGroup& group : std::span(groups_).subspan(first, last - first)) {
        group.sightings = 0;
        for (size_t i = group.first_landmark;
             frame.matches && i < group.first_landmark + group.landmarks; ++i) {
            const defrec_match& match = frame.matches[landmark_order_[i]];
            if (!has_depth(match)) continue;
            const bool chosen = match.weight > 0;
            store_sighting(group.first_sighting + group.sightings++, landmark_places_[i],
                           match_sighting(load3<float>(match.position)),
                           params.match_weight * (chosen ? match.weight : 1.0f),
                           chosen ? 0.0f : ramp, match_c2, 0.0f);
        }
        group.matches = group.sightings;
        for (size_t i = group.first_patch;
             frame.observations && i < group.first_patch + group.patches; ++i) {
            Sighting<float> seen;
            if (!patch_sighting(params.camera, frame.observations[patch_order_[i]], seen)) continue;
            store_sighting(group.first_sighting + group.sightings++, patch_places_[i], seen,
                           params.patch_weight, 0.0f, 0.0f, patch_c2);
        }
        pad_sightings(group);
    }
}

// Empty lanes repeat the last sighting with no weight, so that they compute nothing unusual.
void LmGroups::pad_sightings(LmGroup& group) {
    const size_t end = group.first_sighting + group.sightings;
    for (size_t at = end; group.sightings > 0 && at % kGroupLanes != 0; ++at) {
        for (size_t c = 0; c < size_t(kSightingComponents); ++c)
            sightings_[c * sighting_stride_ + at] = sightings_[c * sighting_stride_ + end - 1];
        sightings_[size_t(kTermWeight) * sighting_stride_ + at] = 0;
    }
}

}  // namespace defrec::cpu
