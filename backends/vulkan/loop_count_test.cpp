// lavapipe ends the loops of an invocation after 65,535 iterations in all, without a word. Every
// stage at the parameters and sizes that make its loops longest, with shaders that count them.
#include <doctest/doctest.h>

#include <random>

#include "backends/vulkan/test_device.hpp"
#include "backends/vulkan/test_loop_counter.hpp"
#include "sdk/contract/stage_params.hpp"

using namespace defrec;
using namespace defrec::vulkan;

namespace {

constexpr uint32_t kLavapipesCap = 65535;

using Bytes = std::vector<uint8_t>;

Bytes noise(size_t size) {
    std::mt19937 random(1);
    Bytes bytes(size);
    for (uint8_t& byte : bytes) byte = uint8_t(random() % 256);
    return bytes;
}
// Dark, with a bright spot in every `period`-th byte: corners far from each other.
Bytes sparse(size_t size, size_t period) {
    Bytes bytes(size, 40);
    for (size_t i = 0; i < size; i += period) bytes[i] = 200;
    return bytes;
}
template <class Record>
Bytes records(const std::vector<Record>& values) {
    Bytes bytes(values.size() * sizeof(Record));
    if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
    return bytes;
}

// A device whose shaders count.
class Counting {
  public:
    Counting() : device_(under_test::new_logical_device()), counter_(device_) {}

    Device& device() { return device_; }
    // An empty input stands for one that is not given.
    void run(std::unique_ptr<vulkan::Stage> stage, const std::vector<Bytes>& prepared,
             const std::vector<Bytes>& in, const std::vector<size_t>& out_sizes) {
        Queue queue(device_);
        RecordedStage recorded(device_, std::move(stage));
        std::vector<Buffer> owned;
        owned.reserve(prepared.size() + in.size() + out_sizes.size());
        const auto upload = [&](const std::vector<Bytes>& all) {
            std::vector<const Buffer*> pointers;
            for (const Bytes& bytes : all) {
                if (!bytes.empty()) owned.push_back(device_.upload(bytes.data(), bytes.size()));
                pointers.push_back(bytes.empty() ? nullptr : &owned.back());
            }
            return pointers;
        };
        if (!prepared.empty()) recorded.prepare(queue, upload(prepared));
        const auto inputs = upload(in);
        std::vector<const Buffer*> outputs;
        for (const size_t size : out_sizes) {
            owned.emplace_back(device_, size);
            outputs.push_back(&owned.back());
        }
        recorded.enqueue(queue, inputs, outputs);
        CHECK(queue.wait(queue.signal(), UINT64_MAX));
        device_.settle();
    }
    // Checks, and says for each shader of the stage that it ran.
    void expect_below_cap(const std::string& stage) {
        const auto counts = counter_.max_iterations();
        size_t shaders = 0, looping = 0;
        for (const auto& [shader, iterations] : counts) {
            if (shader.compare(0, stage.size(), stage) != 0) continue;
            CAPTURE(shader);
            CHECK(iterations < kLavapipesCap);
            ++shaders;
            looping += iterations > 0;
        }
        CHECK(shaders > 0);
        CHECK(looping > 0);
    }

  private:
    Device device_;
    test::LoopCounter counter_;
};

}  // namespace

TEST_CASE("row 48: the loops of rectify") {
    if (!under_test::available()) return;
    Counting counting;
    defrec_rectify_params p{};
    p.format = DEFREC_FORMAT_BGRA8;
    p.source_width = p.width = 300;
    p.source_height = p.height = 100;
    p.highlight_radius = 16;
    fill_defaults(p);
    counting.run(make_rectify(p, counting.device()), {}, {noise(4 * 300 * 100), {}, {}},
                 {300 * 100, 300 * 100});
    counting.expect_below_cap("rectify");
}

TEST_CASE("row 48: the loops of stereo") {
    if (!under_test::available()) return;
    for (const bool wide : {false, true}) {  // the most disparities; the most levels to fill
        Counting counting;
        defrec_stereo_params p{};
        p.width = wide ? 8192 : 300;
        p.height = wide ? 16 : 300;
        p.disparities = wide ? 1 : 510;
        p.min_disparity = wide ? 0 : 1;
        p.radius = p.refine_radius = 6;
        p.fill_radius = 8;
        fill_defaults(p);
        const size_t pixels = size_t{p.width} * p.height;
        const Bytes image = noise(pixels);
        counting.run(make_stereo(p, counting.device()), {}, {image, image, image, image},
                     {2 * pixels, pixels});
        counting.expect_below_cap("stereo");
    }
}

TEST_CASE("row 48: the loops of orb") {
    if (!under_test::available()) return;
    for (const uint32_t cell : {4u, 16u}) {
        Counting counting;
        defrec_orb_params p{};
        p.width = 2048;
        p.height = 700;
        p.levels = 8;
        p.cell = cell;
        p.capacity = 65535;
        p.threshold = 1;
        p.spacing = 1;
        fill_defaults(p);
        const size_t pixels = size_t{p.width} * p.height;
        for (const Bytes& gray : {noise(pixels), sparse(pixels, 40961)})
            counting.run(make_orb(p, counting.device()), {}, {gray, {}},
                         {4, p.capacity * sizeof(defrec_feature)});
        counting.expect_below_cap("orb");
    }
}

TEST_CASE("row 48: the loops of match") {
    if (!under_test::available()) return;
    for (const bool many_features : {false, true}) {
        Counting counting;
        defrec_match_params p{};
        p.landmarks = many_features ? 64 : 65535;
        p.features = many_features ? 65535 : 64;
        p.width = 64;
        p.height = 48;
        p.camera = {100, 100, 32, 24, 5, 0};
        fill_defaults(p);
        counting.run(make_match(p, counting.device()),
                     {noise(p.landmarks * sizeof(defrec_landmark))},
                     {records<uint32_t>({p.features}), noise(p.features * sizeof(defrec_feature)),
                      noise(64 * 48 * 2)},
                     {p.landmarks * sizeof(defrec_match)});
        counting.expect_below_cap("match");
    }
}

TEST_CASE("row 48: the loops of align") {
    if (!under_test::available()) return;
    Counting counting;
    defrec_align_params p{};
    p.patches = 4;
    p.nodes = 1;
    p.width = 200;
    p.height = 160;
    p.patch_radius = 7;
    p.search_radius = 16;
    p.camera = {200, 200, 100, 80, 5, 0};
    fill_defaults(p);
    defrec_patch patch{};
    patch.u = 100;
    patch.v = 80;
    patch.position[2] = 80;
    patch.tangent_u[0] = patch.tangent_v[1] = 0.4f;
    patch.weight[0] = 1;
    const Bytes image = noise(200 * 160);
    const defrec_patch_prediction prediction{100 * 256, 80 * 256, {65536, 0, 0, 65536}, 1, 0};
    counting.run(make_align(p, counting.device()), {records(std::vector(4, patch)), image},
                 {image, {}, {}, records(std::vector(4, prediction))},
                 {4 * sizeof(defrec_patch_observation)});
    counting.expect_below_cap("align");
}

TEST_CASE("row 48: the loops of ransac") {
    if (!under_test::available()) return;
    for (const bool many_matches : {false, true}) {
        Counting counting;
        defrec_ransac_params p{};
        p.landmarks = many_matches ? 65535 : 1100;
        p.references = many_matches ? 2 : 1024;
        p.iterations = many_matches ? 100 : 1;
        fill_defaults(p);
        std::vector<defrec_landmark> landmarks(p.landmarks);
        std::vector<defrec_match> matches(p.landmarks);
        std::mt19937 random(2);
        for (size_t i = 0; i < landmarks.size(); ++i) {
            for (float& x : landmarks[i].position) x = float(random() % 100);
            std::copy_n(landmarks[i].position, 3, matches[i].position);
            matches[i].weight = 1;
        }
        counting.run(make_ransac(p, counting.device()), {records(landmarks)}, {records(matches)},
                     {p.landmarks * sizeof(defrec_match), sizeof(defrec_ransac_summary)});
        counting.expect_below_cap("ransac");
    }
}
