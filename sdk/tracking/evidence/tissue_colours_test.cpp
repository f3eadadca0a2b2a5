// What lies on tissue is told by its colour, and nothing else is: light that changes, other tissue,
// images that are gray.
#include "sdk/tracking/evidence/tissue_colours.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "sdk/base/os/services.hpp"

namespace {

using namespace defrec;

constexpr uint32_t kWidth = 320, kHeight = 240;
constexpr int kStep = 8;  // px, between vertices
constexpr double kFocal = 300, kDepth = 80;

std::shared_ptr<const Rig> rectified_rig() {
    defrec_context_desc context{};
    context.threads = 1;
    defrec_rig_desc desc{};
    desc.struct_size = sizeof desc;
    desc.width = kWidth;
    desc.height = kHeight;
    desc.left = desc.right = {kFocal, kFocal, kWidth / 2.0, kHeight / 2.0, {}, 0, 0};
    for (int i = 0; i < 3; ++i) desc.rotation[4 * i] = 1;
    desc.translation[0] = -5;
    return std::make_shared<const Rig>(std::make_shared<const Services>(context), desc);
}

using Colour = Eigen::Array3f;  // blue, green, red
using ColourAt = std::function<Colour(int x, int y)>;

const Colour kRed(70, 80, 160), kPale(105, 125, 185), kMetal(120, 120, 120), kBlood(20, 20, 120);

// Tissue with pale spots, noise of 4 gray levels.
ColourAt tissue(const Colour& light = Colour::Ones()) {
    return [light](int x, int y) -> Colour {
        return light * (x / 40 % 3 == 0 && y / 40 % 2 == 0 ? kPale : kRed);
    };
}
bool is_in_patch(int x, int y) { return x >= 96 && x < 192 && y >= 80 && y < 160; }
ColourAt with_patch(const ColourAt& image, const Colour& patch) {
    return [=](int x, int y) -> Colour { return is_in_patch(x, y) ? patch : image(x, y); };
}

// A plane before a camera, a vertex each few pixels.
class Frames {
  public:
    Frames() : colours_(rectified_rig()) {
        for (int y = 0; y < static_cast<int>(kHeight); y += kStep)
            for (int x = 0; x < static_cast<int>(kWidth); x += kStep) {
                defrec_surface_sample sample{};
                sample.position[0] = static_cast<float>((x - kWidth / 2.0) * kDepth / kFocal);
                sample.position[1] = static_cast<float>((y - kHeight / 2.0) * kDepth / kFocal);
                sample.position[2] = kDepth;
                sample.observation = DEFREC_OBSERVED;
                samples_.push_back(sample);
                is_in_patch_.push_back(is_in_patch(x, y));
            }
        shown_.assign(samples_.size(), 1);
    }
    void take(const ColourAt& image, uint32_t format = DEFREC_FORMAT_BGR8) {
        std::vector<uint8_t> pixels;
        std::normal_distribution<float> noise(0, 4);
        for (int y = 0; y < static_cast<int>(kHeight); ++y)
            for (int x = 0; x < static_cast<int>(kWidth); ++x)
                for (const float value : image(x, y))
                    pixels.push_back(
                        static_cast<uint8_t>(std::clamp(value + noise(random_), 0.0f, 255.0f)));
        cells_.begin(format, kWidth, kHeight);
        cells_.read_rows({DEFREC_FORMAT_BGR8, pixels.data(), 3 * kWidth, kWidth, kHeight},
                         DEFREC_FIELD_NONE, {0, kHeight});
        colours_.take(cells_);
    }
    void learn(const ColourAt& image, int frames = 8) {
        for (int i = 0; i < frames; ++i) {
            take(image);
            colours_.learn(samples_, shown_);
        }
    }
    void hide_patch() {
        for (size_t i = 0; i < shown_.size(); ++i) shown_[i] = is_in_patch_[i] ? 0 : 1;
    }
    double covered_share(bool in_patch) const {
        double covered = 0, all = 0;
        for (size_t i = 0; i < samples_.size(); ++i) {
            if (is_in_patch_[i] != in_patch) continue;
            ++all;
            covered += colours_.any() && colours_.is_covered(i, samples_[i]);
        }
        return covered / all;
    }
    TissueColours& colours() { return colours_; }

  private:
    TissueColours colours_;
    ColourCells cells_;
    std::vector<defrec_surface_sample> samples_;
    std::vector<bool> is_in_patch_;
    std::vector<uint8_t> shown_;
    std::mt19937 random_{7};
};

}  // namespace

TEST_CASE("metal and blood on the tissue cover it, where they are") {
    for (const Colour& colour : {kMetal, kBlood}) {
        Frames frames;
        frames.learn(tissue());
        frames.take(with_patch(tissue(), colour));
        CHECK(frames.covered_share(true) > 0.9);
        CHECK(frames.covered_share(false) < 0.02);
    }
}

TEST_CASE("a frame is enough to learn the tissue from") {
    Frames frames;
    CHECK_FALSE(frames.colours().any());
    frames.learn(tissue(), 1);
    frames.take(with_patch(tissue(), kMetal));
    CHECK(frames.covered_share(true) > 0.9);
}

TEST_CASE("what stays on the tissue goes on covering it, for it is not learnt from") {
    Frames frames;
    frames.learn(tissue());
    frames.hide_patch();
    frames.learn(with_patch(tissue(), kMetal), 60);
    CHECK(frames.covered_share(true) > 0.9);
    CHECK(frames.covered_share(false) < 0.02);
}

TEST_CASE("other tissue does not cover, nor a highlight, nor the dark") {
    for (const Colour& colour : {kPale, Colour(255, 255, 255), Colour(4, 4, 5)}) {
        Frames frames;
        frames.learn(tissue());
        frames.take(with_patch(tissue(), colour));
        CHECK(frames.covered_share(true) < 0.02);
    }
}

TEST_CASE("light of another colour or brightness covers nothing once a frame showed it") {
    const Colour other_light(1.3f, 1.0f, 0.8f);
    Frames frames;
    frames.learn(tissue());
    frames.hide_patch();
    frames.learn(tissue(other_light), 1);
    frames.take(tissue(other_light));
    CHECK(frames.covered_share(true) < 0.02);
    frames.take(with_patch(tissue(other_light), other_light * kMetal));
    CHECK(frames.covered_share(true) > 0.9);
    frames.take(tissue(0.6f * other_light));
    CHECK(frames.covered_share(true) < 0.02);
}

TEST_CASE("gray frames tell nothing, nor does a template that was not seen yet") {
    Frames frames;
    frames.learn(tissue());
    frames.take(with_patch(tissue(), kMetal), DEFREC_FORMAT_GRAY8);
    CHECK_FALSE(frames.colours().any());
    frames.take(with_patch(tissue(), kMetal));
    CHECK(frames.colours().any());
    frames.colours().forget();
    CHECK_FALSE(frames.colours().any());
}
