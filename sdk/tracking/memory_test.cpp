// Frames in memory of the device, and results left there, on devices that compute in the
// processor's.
#include <doctest/doctest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec::test;

namespace {

// Bytes that are imported for as long as it lives.
class Memory {
  public:
    Memory(defrec_tracker tracker, std::vector<uint8_t> bytes) : bytes_(std::move(bytes)) {
        defrec_memory_desc desc;
        DEFREC_INIT(&desc);
        desc.kind = DEFREC_MEMORY_HOST;
        desc.address = bytes_.data();
        desc.size = bytes_.size();
        REQUIRE_OK(defrec_memory_import(tracker, &desc, &handle_));
    }
    ~Memory() { defrec_memory_release(handle_); }
    Memory(const Memory&) = delete;
    Memory& operator=(const Memory&) = delete;

    defrec_memory get() const { return handle_; }
    const std::vector<uint8_t>& bytes() const { return bytes_; }
    void release() { defrec_memory_release(handle_); }

  private:
    std::vector<uint8_t> bytes_;
    defrec_memory handle_ = nullptr;
};

// A gray image in a tracker's format, rows `stride` bytes apart (0: tight).
std::vector<uint8_t> in_format(const std::vector<uint8_t>& gray, uint32_t format, size_t stride) {
    const size_t channels = format == DEFREC_FORMAT_GRAY8   ? 1
                            : format == DEFREC_FORMAT_BGRA8 ? 4
                                                            : 3;
    if (stride == 0) stride = kWidth * channels;
    std::vector<uint8_t> pixels(stride * kHeight, 0xEE);
    for (size_t y = 0; y < kHeight; ++y)
        for (size_t x = 0; x < kWidth; ++x)
            for (size_t c = 0; c < channels; ++c)
                pixels[y * stride + x * channels + c] = gray[y * kWidth + x];
    return pixels;
}

struct Step {
    Pair pair;
    bool ignore = false;
    uint32_t flags = 0;
};

// Something else in front of most of the tissue.
Pair hidden(Pair pair) {
    const Pair other = render(40, 25);
    for (size_t i = 0; i < pair.left.size(); ++i)
        if (i % kWidth < kWidth * 5 / 8) {
            pair.left[i] = other.left[i];
            pair.right[i] = other.right[i];
        }
    return pair;
}

// A template, motion, a frozen stream, an ignored half, tissue that a wide search does not find
// either, both kinds of blind frames, a surface found again, a template on request.
std::vector<Step> story() {
    Pair black, white;
    std::fill(white.left.begin(), white.left.end(), uint8_t{255});
    white.right = white.left;
    const Pair moved = render(0.7, -0.4, 2, 1);
    return {{black},
            {render(0, 0)},
            {moved},
            {moved},
            {render(1.2, 0, 2, 2), true},
            {hidden(render(1.2, 0, 2, 3))},
            {black},
            {white},
            {render(4, 2)},
            {render(4, 2, 2, 3), false, DEFREC_FRAME_CAPTURE_TEMPLATE},
            {render(4.5, 2)}};
}

std::vector<uint8_t> right_half() {
    std::vector<uint8_t> ignore(kWidth * kHeight);
    for (size_t i = 0; i < ignore.size(); ++i) ignore[i] = i % kWidth > kWidth / 2;
    return ignore;
}

enum class Lies { kBoth, kLeft };  // which views' pixels lie in memory

void check_same_results(const TrackingSession::Change& change, Lies lies = Lies::kBoth) {
    TrackingSession copied("cpu", 2, change), imported("cpu", 2, change);
    defrec_rig_desc rig{};
    defrec_tracker_desc desc{};
    desc.format = DEFREC_FORMAT_GRAY8;
    change(rig, desc);
    const std::vector<uint8_t> ignore = right_half();
    const Memory ignore_memory(imported.tracker, ignore);
    const std::vector<Step> steps = story();
    for (size_t place = 0; place < steps.size(); ++place) {
        CAPTURE(place);
        const Step& step = steps[place];
        TrackingSession::Frame frame;
        frame.flags = step.flags;
        const std::vector<uint8_t> pixels[2] = {in_format(step.pair.left, desc.format, 0),
                                                in_format(step.pair.right, desc.format, 0)};
        frame.left.pixels = pixels[0].data();
        frame.right.pixels = pixels[1].data();
        if (step.ignore) frame.ignore.pixels = ignore.data();
        defrec_job job = nullptr;
        REQUIRE_OK(copied.submit(frame, &job));
        const std::string expected = take_result(job);

        const Memory left(imported.tracker,
                          in_format(step.pair.left, desc.format, desc.memory_stride));
        const Memory right(imported.tracker,
                           in_format(step.pair.right, desc.format, desc.memory_stride));
        frame.left = {nullptr, left.get(), desc.memory_stride};
        if (lies == Lies::kBoth) frame.right = {nullptr, right.get(), 0};
        if (step.ignore) frame.ignore = {nullptr, ignore_memory.get(), 0};
        REQUIRE_OK(imported.submit(frame, &job));
        CHECK((take_result(job) == expected));
    }
}

}  // namespace

TEST_CASE("frames in memory give the same bits as copied ones") {
    SUBCASE("gray") {
        check_same_results([](auto&, auto&) {});
    }
    SUBCASE("one view in memory") {
        check_same_results([](auto&, auto&) {}, Lies::kLeft);
    }
    SUBCASE("BGR, with space between rows") {
        check_same_results([](auto&, auto& desc) {
            desc.format = DEFREC_FORMAT_BGR8;
            desc.memory_stride = 1024;
            desc.keep_disparity = 1;
        });
    }
    SUBCASE("resampled") {
        check_same_results([](auto& rig, auto&) {
            rig.left.distortion_count = rig.right.distortion_count = 4;
            rig.left.distortion[0] = rig.right.distortion[0] = 1e-6;
        });
    }
}

TEST_CASE("the surface is left in memory as the result has it, of lost frames too") {
    TrackingSession session;
    const Memory samples(session.tracker,
                         std::vector<uint8_t>(8192 * sizeof(defrec_surface_sample), 0xEE));
    const std::vector<Step> steps = story();
    for (size_t place = 0; place < steps.size(); ++place) {
        CAPTURE(place);
        const Step& step = steps[place];
        TrackingSession::Frame frame;
        frame.left.pixels = step.pair.left.data();
        frame.right.pixels = step.pair.right.data();
        frame.flags = step.flags;
        frame.samples = samples.get();
        defrec_job job = nullptr;
        REQUIRE_OK(session.submit(frame, &job));
        REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
        defrec_result result;
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        const auto* left = reinterpret_cast<const defrec_surface_sample*>(samples.bytes().data());
        bool same = true;
        for (uint64_t i = 0; i < result.vertex_count; ++i)
            for (int axis = 0; axis < 3; ++axis)
                same &= left[i].position[axis] ==
                            result.vertices[3 * i + static_cast<uint64_t>(axis)] &&
                        left[i].normal[axis] == result.normals[3 * i + static_cast<uint64_t>(axis)];
        CHECK(same);
        CHECK((result.vertex_count > 0) == (result.state != DEFREC_INITIALISING));
        const size_t end = result.vertex_count * sizeof(defrec_surface_sample);
        REQUIRE(end < samples.bytes().size());
        CHECK(std::all_of(samples.bytes().begin() + static_cast<ptrdiff_t>(end),
                          samples.bytes().end(), [](uint8_t byte) { return byte == 0xEE; }));
        defrec_job_release(job);
    }
}

TEST_CASE(
    "memory too small for the samples is how the job fails, with the size needed; the next frame "
    "is followed") {
    TrackingSession session;
    const Memory small(session.tracker, std::vector<uint8_t>(64));
    const Pair pair = render(0, 0);
    TrackingSession::Frame frame;
    frame.left.pixels = pair.left.data();
    frame.right.pixels = pair.right.data();
    frame.samples = small.get();
    defrec_job job = nullptr;
    REQUIRE_OK(session.submit(frame, &job));
    CHECK(defrec_job_wait(job, UINT64_MAX) == DEFREC_ERROR_ARGUMENT);
    const std::string text = defrec_last_error();
    defrec_job_release(job);
    frame.samples = nullptr;
    REQUIRE_OK(session.submit(frame, &job));
    REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
    defrec_result result;
    DEFREC_INIT(&result);
    REQUIRE_OK(defrec_job_result(job, &result));
    CHECK(result.state == DEFREC_TRACKING);
    CHECK(contains(text, "samples: the memory has 64 bytes, " +
                             std::to_string(32 * result.vertex_count) + " are needed"));
    defrec_job_release(job);
}

TEST_CASE("memory that cannot be imported is refused with the reason") {
    TrackingSession session;
    alignas(16) static uint8_t bytes[64];
    const auto status_after = [&](auto change) {
        defrec_memory_desc desc;
        DEFREC_INIT(&desc);
        desc.kind = DEFREC_MEMORY_HOST;
        desc.address = bytes;
        desc.size = sizeof bytes;
        change(desc);
        defrec_memory out = nullptr;
        const defrec_status status = defrec_memory_import(session.tracker, &desc, &out);
        CHECK((out == nullptr) == (status < 0));
        defrec_memory_release(out);
        return status;
    };
    CHECK(status_after([](auto&) {}) == DEFREC_OK);
    CHECK(status_after([](auto& d) { d.kind = 0; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "kind is 0"));
    CHECK(status_after([](auto& d) { d.kind = 3; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& d) { d.kind = DEFREC_MEMORY_CUDA; }) == DEFREC_ERROR_UNSUPPORTED);
    CHECK(contains(defrec_last_error(), "cpu: buffer_import"));
    CHECK(status_after([](auto& d) { d.address = nullptr; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "address is NULL"));
    CHECK(status_after([](auto& d) { d.address = bytes + 1; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(contains(defrec_last_error(), "multiple of 16"));
    CHECK(status_after([](auto& d) { d.size = 0; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& d) { d.size = UINT64_MAX; }) == DEFREC_ERROR_ARGUMENT);
    CHECK(status_after([](auto& d) { d.struct_size = 3; }) == DEFREC_ERROR_VERSION);
    defrec_memory out = nullptr;
    CHECK(defrec_memory_import(session.tracker, nullptr, &out) == DEFREC_ERROR_ARGUMENT);
    defrec_memory_desc desc;
    DEFREC_INIT(&desc);
    CHECK(defrec_memory_import(session.tracker, &desc, nullptr) == DEFREC_ERROR_ARGUMENT);
    CHECK(defrec_memory_import(nullptr, &desc, &out) == DEFREC_ERROR_ARGUMENT);
    CHECK(out == nullptr);
}

TEST_CASE(
    "frames whose memory does not fit are refused with the reason, and the queue stays as it was") {
    TrackingSession session, other;
    const Pair pair = render(0, 0);
    const Memory left(session.tracker, pair.left),
        short_of_one(session.tracker, {pair.left.begin(), pair.left.end() - 1});
    const Memory foreign(other.tracker, pair.left);
    Memory released(session.tracker, pair.left);
    released.release();
    const auto check = [&](defrec_status expected, const char* words, auto change) {
        TrackingSession::Frame frame;
        frame.left.memory = left.get();
        frame.right.pixels = pair.right.data();
        change(frame);
        defrec_job job = nullptr;
        CHECK(session.submit(frame, &job) == expected);
        CHECK(contains(defrec_last_error(), words));
        CHECK(job == nullptr);
    };
    check(DEFREC_ERROR_ARGUMENT, "left: the memory was imported for another tracker",
          [&](auto& f) { f.left.memory = foreign.get(); });
    check(DEFREC_ERROR_ARGUMENT, "samples: the memory was imported for another tracker",
          [&](auto& f) { f.samples = foreign.get(); });
    check(DEFREC_ERROR_ARGUMENT, "left: the memory has 76799 bytes, 76800 are needed",
          [&](auto& f) { f.left.memory = short_of_one.get(); });
    check(DEFREC_ERROR_ARGUMENT, "left: stride is 336 bytes, this tracker takes 320 in memory",
          [&](auto& f) { f.left.stride = 336; });
    check(DEFREC_ERROR_ARGUMENT, "left: both pixels and memory are given",
          [&](auto& f) { f.left.pixels = pair.left.data(); });
    check(DEFREC_ERROR_ARGUMENT, "right: pixels is NULL",
          [&](auto& f) { f.right.pixels = nullptr; });
    check(DEFREC_ERROR_HANDLE, "destroyed already",
          [&](auto& f) { f.left.memory = released.get(); });
    check(DEFREC_ERROR_HANDLE, "destroyed already", [&](auto& f) { f.samples = released.get(); });
    check(DEFREC_ERROR_HANDLE, "a tracker handle was given",
          [&](auto& f) { f.left.memory = reinterpret_cast<defrec_memory>(session.tracker); });
    TrackingSession::Frame frame;
    frame.left.memory = left.get();
    frame.right.pixels = pair.right.data();
    defrec_job job = nullptr;
    REQUIRE_OK(session.submit(frame, &job));
    take_result(job);
}

TEST_CASE("a tracker's stride in memory is at least a row") {
    defrec_tracker tracker = nullptr;
    TrackingSession session;
    for (const uint32_t stride : {319u, 1u << 21}) {
        defrec_tracker_desc desc;
        DEFREC_INIT(&desc);
        desc.format = DEFREC_FORMAT_GRAY8;
        desc.memory_stride = stride;
        CHECK(defrec_tracker_create(session.context, session.rig, &desc, &tracker) ==
              DEFREC_ERROR_ARGUMENT);
        CHECK(contains(defrec_last_error(), "memory_stride is " + std::to_string(stride)));
    }
    CHECK(tracker == nullptr);
}

TEST_CASE("memory, job, tracker and context may go in any order") {
    const Pair pair = render(0, 0);
    int order[] = {0, 1, 2, 3};
    do {
        auto session = std::make_unique<TrackingSession>();
        Memory left(session->tracker, pair.left),
            samples(session->tracker, std::vector<uint8_t>(1 << 18));
        TrackingSession::Frame frame;
        frame.left.memory = left.get();
        frame.right.pixels = pair.right.data();
        frame.samples = samples.get();
        defrec_job job = nullptr;
        REQUIRE_OK(session->submit(frame, &job));
        for (const int what : order) switch (what) {
                case 0:
                    left.release(), samples.release();
                    break;
                case 1:
                    defrec_job_release(job);
                    break;
                case 2:
                    defrec_tracker_destroy(session->tracker);
                    break;
                case 3:
                    defrec_context_destroy(session->context);
                    break;
            }
        session->tracker = nullptr;
        session->context = nullptr;
    } while (std::next_permutation(std::begin(order), std::end(order)));
}

TEST_CASE("a frame is computed although its memory's handles are released") {
    TrackingSession session;
    const Pair pair = render(0, 0);
    Memory left(session.tracker, pair.left), right(session.tracker, pair.right);
    TrackingSession::Frame frame;
    frame.left.memory = left.get();
    frame.right.memory = right.get();
    defrec_job job = nullptr;
    REQUIRE_OK(session.submit(frame, &job));
    left.release();
    right.release();
    REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
    defrec_result result;
    DEFREC_INIT(&result);
    REQUIRE_OK(defrec_job_result(job, &result));
    CHECK(result.state == DEFREC_TRACKING);
    defrec_job_release(job);
}
