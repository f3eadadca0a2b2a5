// Tests of the stages' contracts: the sizes that docs/stages names, constants, and refusals of
// templates that no run could trust.
#include <doctest/doctest.h>

#include <limits>
#include <vector>

#include "backends/stages/all.hpp"

using namespace defrec;

namespace {

using Sizes = std::vector<uint64_t>;

Sizes bytes(const BufferRules& rules) {
    Sizes all;
    for (const BufferRule& rule : rules.all()) all.push_back(rule.bytes);
    return all;
}
template <class Params>
Sizes inputs(const Params& params) {
    return bytes(buffer_table(params).inputs);
}
template <class Params>
Sizes outputs(const Params& params) {
    return bytes(buffer_table(params).outputs);
}

// An image of 63 x 47 with rows 70 apart, in elements.
constexpr uint64_t kWidth = 63, kHeight = 47, kStride = 70, kImage = kStride * 46 + kWidth;
template <class Params>
Params with_image() {
    Params params{};
    params.width = kWidth;
    params.height = kHeight;
    params.stride = kStride;
    return params;
}

template <class T>
InBuffer buffer(const std::vector<T>& values) {
    return {values.data(), values.size() * sizeof(T)};
}

}  // namespace

TEST_CASE("rectify: sizes follow the format, both strides and the map") {
    auto p = with_image<defrec_rectify_params>();
    p.format = DEFREC_FORMAT_BGR8;
    p.source_width = 80;
    p.source_height = 60;
    p.source_stride = 256;
    CHECK(inputs(p) == Sizes{256 * 59 + 240, 8 * kWidth * kHeight, 80 * 60});
    CHECK(outputs(p) == Sizes{kImage, kImage});
    const std::vector<uint8_t> source(256 * 60);
    std::vector<uint8_t> gray(kImage), mask(kImage);
    const InBuffer in[] = {buffer(source)};
    const OutBuffer out[] = {{gray.data(), kImage}, {mask.data(), kImage}};
    CHECK_THROWS_WITH_AS(rectify_buffers(p, in, out),
                         "rectify: without a map the result must have the source's size",
                         StageError);
}

TEST_CASE("stereo: sizes of an odd image, and what follows from the parameters") {
    auto p = with_image<defrec_stereo_params>();
    p.min_disparity = 5;
    p.disparities = 20;
    p.radius = 4;
    p.min_score = 2048;
    p.uniqueness = 41;
    p.texture = 8;
    p.fill_radius = 6;
    p.smooth_radius = 3;
    CHECK(inputs(p) == Sizes(4, kImage));
    const uint64_t full = kWidth * kHeight, samples = 32 * 24, half_samples = 16 * 12;
    CHECK(outputs(p) == Sizes{2 * kImage, kImage, full, full, 4 * half_samples, 4 * 31 * 12,
                              2 * half_samples, 2 * half_samples, 2 * half_samples,
                              2 * half_samples, 2 * full, 2 * samples, 2 * samples, 2 * samples,
                              2 * samples});
    const StereoConstants c = constants_of(p);
    CHECK(c.half_width == 31);
    CHECK(c.half_height == 23);
    CHECK(c.fill_radius == 3);  // in samples
    CHECK(c.smooth_radius == 2);
    CHECK(c.first == 2);  // disparities 5 .. 24 are 2 .. 12 at half resolution
    CHECK(c.count == 11);
    CHECK(c.one_over_n == 1.0f / 81);
    CHECK(c.min_score == 0.5f / 81);
    CHECK(c.min_lead == 41 * (0x1p-12f / 81));
    CHECK(256 * int64_t{c.min_variance} >= 8 * 8 * 81 * 81);
    CHECK(256 * (int64_t{c.min_variance} - 1) < 8 * 8 * 81 * 81);
}

TEST_CASE("orb: sizes of the sub-stages follow the levels of the pyramid") {
    auto p = with_image<defrec_orb_params>();
    p.width = 200;
    p.height = 100;
    p.stride = 200;
    p.levels = 2;
    p.cell = 8;
    p.capacity = 500;
    // 160 x 80; without a border of 17 px 166 x 66 and 126 x 46.
    const uint64_t pixels = 200 * 100 + 160 * 80, cells = 21 * 9 + 16 * 6;
    CHECK(inputs(p) == Sizes{20000, 20000});
    CHECK(outputs(p) ==
          Sizes{4, 500 * sizeof(defrec_feature), pixels, 2 * pixels, pixels, 4 * cells, cells});
    p.width = p.stride = 201;
    const orb::Layout layout = orb::make_layout(p);
    const auto levels = orb::device_levels(layout);
    CHECK(levels[0].stride == 204);
    CHECK(levels[1].first == 204 * 100);
    CHECK(levels[1].first_pixel == 201 * 100);
    CHECK(orb::device_pixels(layout) == 204 * 100 + 160 * 80);
    CHECK(constants_of(p, layout).cells == int(layout.cells));
}
TEST_CASE("orb: levels are those of the halved image, as many as have a pixel") {
    auto p = with_image<defrec_orb_params>();
    p.width = p.stride = 403;
    p.height = 206;
    p.levels = 2;
    p.cell = 8;
    p.capacity = 500;
    p.halvings = 1;
    // 201 x 103 and 160 x 82
    const uint64_t pixels = 201 * 103 + 160 * 82, cells = 21 * 9 + 16 * 6;
    CHECK(inputs(p) == Sizes{403 * 206, 403 * 206});
    CHECK(outputs(p) ==
          Sizes{4, 500 * sizeof(defrec_feature), pixels, 2 * pixels, pixels, 4 * cells, cells});
    p.width = p.stride = DEFREC_MIN_WIDTH;
    p.height = DEFREC_MIN_HEIGHT;
    p.levels = 8;
    p.halvings = 3;
    const orb::Layout layout = orb::make_layout(p);
    CHECK(layout.levels == 5);
    CHECK(layout.pixels == 8 * 6 + 6 * 4 + 4 * 3 + 3 * 2 + 2 * 1);
    CHECK(layout.cells == 0);
    CHECK(constants_of(p, layout).levels == 5);
}

TEST_CASE("match and ransac: records are counted by what prepare was given") {
    auto m = with_image<defrec_match_params>();
    m.landmarks = 10;
    m.features = 4;
    CHECK(inputs(m) == Sizes{4, 0, 2 * kImage});
    CHECK(outputs(m) == Sizes{0});
    const BufferTable table = table_of<MatchBuffers>(MatchBuffers::Sizes{m, 7});
    CHECK(table.outputs.bytes(0) == 7 * sizeof(defrec_match));
    const uint32_t count = 9;
    const std::vector<defrec_feature> features(4);
    const InBuffer in[] = {{&count, 4}, buffer(features)};
    MatchBuffers given{};
    given.count = &count;
    CHECK(live_features(m, given, in) == 4);
    CHECK(room_for_features(m, {features.data(), 3 * sizeof(defrec_feature) + 1}) == 3);
    CHECK_THROWS_AS(room_for_features(m, {}), StageError);
    CHECK_THROWS_AS(live_features(m, given, std::vector<InBuffer>{in[0], {features.data(), 100}}),
                    StageError);

    defrec_ransac_params r{};
    r.landmarks = 10;
    r.seed = 0x123456789abcdef0;
    CHECK(inputs(r) == Sizes{0});
    CHECK(outputs(r) == Sizes{0, sizeof(defrec_ransac_summary)});
    CHECK(bytes(table_of<RansacBuffers>(uint64_t{7}).inputs) == Sizes{7 * sizeof(defrec_match)});
    const std::vector<defrec_landmark> landmarks(12);
    CHECK(read_template(r, std::vector<InBuffer>{buffer(landmarks)}).size() == 10);
    CHECK(constants_of(r, 7).landmarks == 7);
    CHECK(constants_of(r, 7).seed_low == 0x9abcdef0);
    CHECK(constants_of(r, 7).seed_high == 0x12345678);
}

TEST_CASE("align: constants of a level, and templates that name what does not exist") {
    auto p = with_image<defrec_align_params>();
    p.nodes = 5;
    p.patches = 3;
    p.views = 2;
    p.level = 1;
    p.patch_radius = 5;
    CHECK(inputs(p) == Sizes{kImage, kImage, 5 * sizeof(defrec_motion), 0});
    CHECK(outputs(p) == Sizes{0, 0});
    const AlignConstants c = constants_of(p);
    CHECK(c.width == 31);
    CHECK(c.view_height == 46);
    CHECK(c.max_u == 62 * 256);
    CHECK(c.margin == 14);
    p.camera.cx = 30;
    p.camera.baseline_mm = 4;
    p.camera.disparity_offset_px = 500;
    CHECK(constants_of(p).live_x == 0);
    CHECK(constants_of(p).live_cx == 30);
    p.right_view = 1;
    CHECK(constants_of(p).live_x == 4);
    CHECK(constants_of(p).live_cx == 530);

    std::vector<defrec_patch> patches(4);
    const std::vector<uint8_t> views(kStride * kHeight + kImage);
    const auto read = [&](const std::vector<uint8_t>& given) {
        return read_template(p, std::vector<InBuffer>{buffer(patches), buffer(given)});
    };
    const std::vector<defrec_patch_slope> slopes(3, {{0.5f}, {}});
    const auto with_slopes = [&](size_t bytes) {
        InBuffer given = buffer(slopes);
        given.size = bytes;
        return read_template(p, std::vector<InBuffer>{buffer(patches), buffer(views), given})
            .slopes;
    };
    REQUIRE(with_slopes(3 * sizeof(defrec_patch_slope)).size() == 3);
    CHECK(with_slopes(3 * sizeof(defrec_patch_slope))[2].weight_u[0] == 0.5f);
    CHECK_THROWS_AS(with_slopes(3 * sizeof(defrec_patch_slope) - 1), StageError);
    REQUIRE(read(views).slopes.size() == 3);
    CHECK(read(views).slopes[2].weight_u[0] == 0);
    CHECK(read(views).patches.size() == 3);
    CHECK(read(views).views == views.data());
    CHECK_THROWS_AS(read({views.begin() + 1, views.end()}), StageError);
    patches[2].view = 2;
    CHECK_THROWS_AS(read(views), StageError);
    patches[2].view = 1;
    patches[1].node[3] = 5;
    CHECK_THROWS_AS(read(views), StageError);

    std::vector<uint8_t> gray(kImage);
    std::vector<defrec_patch_observation> observations(1);
    const InBuffer in[] = {buffer(gray)};
    const OutBuffer out[] = {{observations.data(), sizeof observations[0]}};
    CHECK_NOTHROW(align_buffers(p, 0, in, out));
    CHECK_THROWS_WITH_AS(align_buffers(p, 1, in, out),
                         "align: neither motions nor predictions given", StageError);
}

TEST_CASE("warp: sizes, and templates with what is not finite or does not exist") {
    auto w = with_image<defrec_warp_params>();
    w.nodes = 4;
    w.points = 2;
    CHECK(inputs(w) == Sizes{4 * sizeof(defrec_motion), 2 * kImage});
    CHECK(outputs(w) == Sizes{2 * sizeof(defrec_surface_sample)});
    std::vector<defrec_surface_point> points(2);
    const auto read_points = [&] {
        return read_template(w, std::vector<InBuffer>{buffer(points)});
    };
    CHECK(read_points().points == points.data());
    points[1].node[2] = 4;
    CHECK_THROWS_AS(read_points(), StageError);
    points[1].node[2] = 3;
    points[0].weight[1] = std::numeric_limits<float>::infinity();
    CHECK_THROWS_AS(read_points(), StageError);
}

TEST_CASE("lm: sizes, and templates with what is not finite or does not exist") {
    auto l = with_image<defrec_lm_params>();
    l.nodes = 2;
    l.edges = l.points = l.landmarks = l.patches = 1;
    l.node_spacing_mm = 5;
    l.angle_weight = 20;
    l.match_threshold_mm = 2;
    l.solver = DEFREC_SOLVER_COUPLED;
    l.cg_iterations = 7;
    CHECK(inputs(l) == Sizes{2 * sizeof(defrec_motion), sizeof(defrec_match),
                             sizeof(defrec_patch_observation), 2 * kImage});
    CHECK(outputs(l) == Sizes{2 * sizeof(defrec_motion), sizeof(defrec_lm_summary)});
    CHECK(constants_of(l).angle_weight == 500);
    CHECK(constants_of(l).match_slope == 0.1f);
    CHECK(gradient_steps(l) == 7);
    l.solver = DEFREC_SOLVER_INDEPENDENT;
    CHECK(gradient_steps(l) == 0);

    std::vector<float> nodes{0, 0, 50, 5, 0, 50};
    std::vector<defrec_edge> edges{{0, 1, 1.0f}};
    std::vector<defrec_surface_point> surface(1), landmarks(1);
    std::vector<defrec_patch> patches(1);
    const auto read = [&] {
        return read_template(l, std::vector<InBuffer>{buffer(nodes), buffer(edges), buffer(surface),
                                                      buffer(landmarks), buffer(patches)});
    };
    CHECK(read().edges == edges.data());
    for (const defrec_edge& bad : {defrec_edge{0, 2, 1.0f},
                                   {-1, 0, 1.0f},
                                   {1, 1, 1.0f},
                                   {0, 1, 0.0f},
                                   {0, 1, std::numeric_limits<float>::quiet_NaN()}}) {
        edges[0] = bad;
        CHECK_THROWS_AS(read(), StageError);
    }
    edges[0] = {0, 1, 1.0f};
    nodes[4] = std::numeric_limits<float>::quiet_NaN();
    CHECK_THROWS_AS(read(), StageError);
    nodes[4] = 0;
    surface[0].normal[0] = std::numeric_limits<float>::infinity();
    CHECK_THROWS_AS(read(), StageError);
    surface[0].normal[0] = 0;
    patches[0].node[0] = 2;
    CHECK_THROWS_AS(read(), StageError);
}
