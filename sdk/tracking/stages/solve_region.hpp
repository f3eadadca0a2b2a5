// The part of a large map that a frame's image can say something about. The finer passes of the
// solver solve it alone: what lies far outside of the image stays where the coarse pass puts it.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"
#include "sdk/tracking/decisions/stages.hpp"

namespace defrec {

// What stage lm is prepared with for a part of a template. Control points keep their numbers. Two
// more follow, as a pair of their own: their connection weighs as much as those that are left out,
// since the stage measures an edge's weight against the mean of all.
struct RegionLists {
    std::vector<float> nodes;  // xyz
    std::vector<defrec_edge> edges;
    std::vector<defrec_surface_point> points, landmarks;
    std::vector<defrec_patch> patches;
};

class SolveRegion {
  public:
    static constexpr size_t kPair = 2;  // control points that follow the template's
    enum class Choice {
        kSame,      // lists() are what they were
        kOther,     // they changed
        kTooLarge,  // too much of the map lies in the image
    };

    // Whether a template is so much larger than an image that a part is worth its while.
    static bool suits(const TemplateData& data);
    // points: that the solver compares with depth. All lists have their final sizes from here on.
    SolveRegion(const TemplateData& data, std::span<const defrec_surface_point> points);

    // Chooses the part for a frame that starts with these motions: of the control points.
    Choice choose(std::span<const defrec_motion> motions);
    const RegionLists& lists() const { return lists_; }

    // Whether the part that was chosen last has all control points that lie in the image.
    bool covers_image(std::span<const defrec_motion> motions) const {
        return covers(motions, {0, 0});
    }

  private:
    // Round the image.
    struct Margin {
        double spacings, share;  // between control points; of the image's mean side
    };
    template <class Function>
    void near_image(std::span<const defrec_motion> motions, const Margin& margin,
                    const Function& visit) const;
    bool covers(std::span<const defrec_motion> motions, const Margin& margin) const;
    bool fill();
    template <class Item>
    bool is_solved(const Item& item) const;
    template <class Item>
    void fill_items(const std::vector<Item>& all, std::span<const int32_t> followed,
                    std::vector<Item>& items) const;
    std::vector<int32_t> followed_nodes() const;

    const defrec_camera camera_;
    const uint32_t width_, height_;
    const double spacing_mm_;
    const size_t nodes_;
    std::vector<defrec_edge> edges_;
    std::vector<defrec_surface_point> points_, landmarks_;
    std::vector<defrec_patch> patches_;
    double edge_weights_ = 0;
    std::vector<uint8_t> solved_;  // per control point
    bool is_chosen_ = false;
    uint32_t frames_ = 0;                             // since it was
    size_t slack_ = decisions::MapPart::kFirstSlack;  // of its kSlack
    RegionLists lists_;
};

}  // namespace defrec
