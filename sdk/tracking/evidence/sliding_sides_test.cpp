// On which side of a cut a vertex is: what may be wrong with it.
#include "sdk/tracking/evidence/sliding_sides.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "sdk/template/cut.hpp"
#include "sdk/template/test_capture.hpp"
#include "sdk/tracking/decisions/confidence.hpp"

using namespace defrec;

namespace {

constexpr uint32_t kWidth = 320, kHeight = 240;
constexpr defrec_camera kCamera{340, 340, 160, 120, 5, 0};
constexpr double kDepth = 80, kCutU = 162, kSecondU = 190;  // mm, px; between vertices
constexpr float kSlide = 6;  // mm, down, of the tissue to the right of the cut

// A plane with cuts from the upper to the lower border.
TemplateData parted_plane(const std::vector<double>& cuts_u) {
    const test::PlaneImages images(kWidth, kHeight, kCamera, kDepth);
    TemplateData data = *capture_template(
        test::capture_input(kWidth, kHeight, kCamera, images.gray, images.mask, images.disparity));
    for (const double u : cuts_u) {
        const auto at = static_cast<float>(u);
        data = release_across(std::move(data), {0, {{at, -10}, {at, kHeight / 2.0f}, {at, 250}}});
    }
    return data;
}

double u_of(const TemplateData& data, size_t vertex) {
    const float* at = data.vertices[vertex].position;
    return kCamera.fx * double{at[0]} / double{at[2]} + kCamera.cx;
}

// Per vertex; slides(u): whether the tissue there has slid.
template <class Slides>
std::vector<float> expected_of(const TemplateData& data, const Slides& slides,
                               uint8_t unconfirmed) {
    std::vector<defrec_surface_sample> samples(data.vertices.size());
    for (size_t i = 0; i < samples.size(); ++i) {
        std::copy_n(data.vertices[i].position, 3, samples[i].position);
        if (slides(u_of(data, i))) samples[i].position[1] += kSlide;
    }
    const std::vector<uint8_t> frames(data.grid.vertex.size(), unconfirmed);
    std::vector<float> error(samples.size(), -1.0f);
    CutSides(data).expect(data, samples, frames, error);
    return error;
}
// All to the right of a pixel has.
std::vector<float> expected(const TemplateData& data, double from_u, uint8_t unconfirmed) {
    return expected_of(
        data, [=](double u) { return u > from_u; }, unconfirmed);
}

constexpr uint8_t kDoubted = decisions::Confidence::kSideDoubted;

}  // namespace

TEST_CASE("the side of a cut is doubted close to it alone where tissue is as it is expected") {
    const TemplateData data = parted_plane({kCutU});
    const double spacing = data.node_grid.spacing_u;
    const std::vector<float> error = expected(data, kCutU, kDoubted - 1);
    CHECK(*std::max_element(error.begin(), error.end()) > kSlide / 4);
    for (size_t i = 0; i < error.size(); ++i)
        if (std::abs(u_of(data, i) - kCutU) > 1.2 * spacing) CHECK(error[i] == 0);
    CHECK(expected(data, kCutU, 0) == error);
}

TEST_CASE("tissue beside a cut that shows something else may be on the other side of it") {
    const TemplateData data = parted_plane({kCutU});
    const double reach = decisions::Confidence::kSideReach * data.node_grid.spacing_u;
    const std::vector<float> error = expected(data, kCutU, kDoubted);
    size_t beside = 0;
    for (size_t i = 0; i < error.size(); ++i) {
        const double apart = std::abs(u_of(data, i) - kCutU);
        if (apart > reach + 1) CHECK(error[i] == 0);
        if (apart > reach - data.grid.spacing) continue;
        CHECK(error[i] == doctest::Approx(kSlide).epsilon(1e-3));
        ++beside;
    }
    CHECK(beside > 100);
}

TEST_CASE("what lies behind another cut tells nothing of a side") {
    // Both lines slide, alike: what is between them stays.
    const TemplateData data = parted_plane({kCutU, kSecondU});
    const std::vector<float> error = expected_of(
        data, [](double u) { return u < kCutU || u > kSecondU; }, kDoubted);
    size_t between = 0;
    for (size_t i = 0; i < error.size(); ++i) {
        if (u_of(data, i) < kCutU + 2 || u_of(data, i) > kSecondU - 2) continue;
        CHECK(error[i] == doctest::Approx(kSlide).epsilon(1e-3));
        ++between;
    }
    CHECK(between > 50);
}

TEST_CASE("between two cuts tissue may be on the far side of either") {
    // The second line is where the sides meet; between the lines tissue went with the left one.
    const TemplateData data = parted_plane({kCutU, kSecondU});
    const std::vector<float> error = expected(data, kSecondU, kDoubted);
    size_t between = 0;
    for (size_t i = 0; i < error.size(); ++i) {
        if (u_of(data, i) < kCutU + 2 || u_of(data, i) > kCutU + 12) continue;
        CHECK(error[i] == doctest::Approx(kSlide).epsilon(1e-3));
        ++between;
    }
    CHECK(between > 10);
}
