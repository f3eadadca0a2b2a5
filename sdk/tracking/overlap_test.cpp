// The next frame's images are worked on while the host concludes a frame, and a frame is followed
// before the host has looked at its images; nothing but the time may tell.
#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec::test;

namespace {

// A device in the processor's memory whose queues have threads of their own:
// sdk/plugin/test_plugins/asynchronous_plugin.cpp.
const std::string kAsynchronous = std::string(DEFREC_BUILD_DIR) + "/test_plugins/asynchronous";
const char* const kPaths[] = {kAsynchronous.c_str()};
void add_asynchronous(defrec_context_desc& desc) {
    desc.plugin_paths = kPaths;
    desc.plugin_path_count = 1;
}

struct Step {
    Pair pair;
    uint32_t flags = 0;
    bool ignore = false, little_room = false, set_template = false, refused = false,
         in_memory = false;
};

std::vector<Step> story() {
    Pair white;
    std::fill(white.left.begin(), white.left.end(), uint8_t{255});
    white.right = white.left;
    std::vector<Step> steps;
    const auto add = [&](const Pair& pair) -> Step& {
        steps.push_back({pair});
        return steps.back();
    };
    add(Pair());
    for (int i = 0; i < 4; ++i) add(render(0.5 * i, 0.2 * i, 2, static_cast<uint64_t>(i)));
    add(steps.back().pair);
    add(render(2, 1, 2, 5)).ignore = true;
    add(white);
    add(render(2, 1, 2, 6)).little_room = true;
    add(render(2.5, 1, 2, 7));
    Step& refused = add(render(2.7, 1, 2, 8));
    std::copy_n("refuse", 6, refused.pair.left.begin());
    refused.refused = true;
    add(render(3, 1, 2, 9));
    add(render(3, 1, 2, 10)).flags = DEFREC_FRAME_CAPTURE_TEMPLATE;
    add(render(3.5, 1, 2, 11));
    add(render(1, 0, 2, 12)).set_template = true;
    add(render(1.5, 0, 2, 13));
    add(render(11, 3, 2, 14));
    add(render(11.5, 3, 2, 15));
    add(render(12, 3, 2, 16)).pair.right = steps[steps.size() - 2].pair.right;
    add(render(12.5, 3, 2, 17));
    for (size_t i = 0; i < steps.size(); ++i) steps[i].in_memory = !steps[i].refused && i % 3 != 0;
    return steps;
}

// What each step gave, or how it failed. waiting: frames kept in the queue.
std::vector<std::string> play(const std::vector<Step>& steps, const char* device,
                              uint32_t waiting) {
    TrackingSession session(
        device, 2,
        [&](auto&, auto& desc) {
            desc.frames_in_flight = waiting;
            desc.keep_disparity = 1;
        },
        add_asynchronous);
    std::vector<uint8_t> upper_half(kWidth * kHeight);
    std::fill(upper_half.begin(), upper_half.begin() + kWidth * kHeight / 2, uint8_t{1});
    const auto import = [&](const std::vector<uint8_t>& bytes) {
        defrec_memory_desc desc;
        DEFREC_INIT(&desc);
        desc.kind = DEFREC_MEMORY_HOST;
        desc.address = const_cast<uint8_t*>(bytes.data());
        desc.size = bytes.size();
        defrec_memory memory = nullptr;
        REQUIRE_OK(defrec_memory_import(session.tracker, &desc, &memory));
        return memory;
    };
    const std::vector<uint8_t> room(64);
    const defrec_memory little = import(room);
    defrec_template surface = nullptr;
    {
        TrackingSession other;
        const Pair pair = render(0.3, 0.1);
        TrackingSession::Frame frame;
        frame.left.pixels = pair.left.data();
        frame.right.pixels = pair.right.data();
        defrec_job job = nullptr;
        REQUIRE_OK(other.submit(frame, &job));
        take_result(job);
        REQUIRE_OK(defrec_tracker_get_template(other.tracker, &surface));
    }

    std::vector<std::string> results;
    std::deque<defrec_job> jobs;
    const auto take = [&] {
        const defrec_status status = defrec_job_wait(jobs.front(), UINT64_MAX);
        if (status == DEFREC_OK) {
            results.push_back(take_result(jobs.front()));
        } else {
            results.push_back(defrec_last_error());
            defrec_job_release(jobs.front());
        }
        jobs.pop_front();
    };
    for (const Step& step : steps) {
        if (jobs.size() == waiting) take();
        if (step.set_template) REQUIRE_OK(defrec_tracker_set_template(session.tracker, surface));
        TrackingSession::Frame frame;
        if (step.in_memory) {
            frame.left.memory = import(step.pair.left);
            frame.right.memory = import(step.pair.right);
        } else {
            frame.left.pixels = step.pair.left.data();
            frame.right.pixels = step.pair.right.data();
        }
        if (step.ignore) frame.ignore.pixels = upper_half.data();
        if (step.little_room) frame.samples = little;
        frame.flags = step.flags;
        jobs.emplace_back();
        REQUIRE_OK(session.submit(frame, &jobs.back()));
        defrec_memory_release(frame.left.memory);
        defrec_memory_release(frame.right.memory);
    }
    while (!jobs.empty()) take();
    defrec_template_release(surface);
    defrec_memory_release(little);
    return results;
}

// What a frame gave, the names of its times and the samples in memory, or how it failed.
std::string track(TrackingSession& session, TrackingSession::Frame frame, size_t room) {
    std::vector<uint8_t> samples(room, uint8_t{0xEE});
    defrec_memory_desc desc;
    DEFREC_INIT(&desc);
    desc.kind = DEFREC_MEMORY_HOST;
    desc.address = samples.data();
    desc.size = samples.size();
    if (room != 0) REQUIRE_OK(defrec_memory_import(session.tracker, &desc, &frame.samples));
    defrec_job job = nullptr;
    REQUIRE_OK(session.submit(frame, &job));
    defrec_memory_release(frame.samples);
    if (defrec_job_wait(job, UINT64_MAX) != DEFREC_OK) {
        const std::string error = defrec_last_error();
        defrec_job_release(job);
        return error;
    }
    defrec_result result;
    DEFREC_INIT(&result);
    REQUIRE_OK(defrec_job_result(job, &result));
    std::string all;
    for (uint32_t i = 0; i < result.time_count; ++i) all += result.times[i].name;
    all += take_result(job);
    all.append(samples.begin(), samples.end());
    return all;
}

// Holds a device's thread at the end of a frame until the next frame's images have been asked for.
struct Gate {
    std::mutex mutex;
    std::condition_variable changed;
    int rectified = 0;   // views asked for
    int awaited = 1000;  // of them that open the gate
    bool closed = false, opened = false;

    // How often a surface was asked for.
    int warped = 0;

    static void log(void* user, int32_t, const char*, const char* text) {
        Gate& gate = *static_cast<Gate*>(user);
        const std::string event = text;
        std::unique_lock lock(gate.mutex);
        if (event == "asked for 0") ++gate.rectified;
        if (event == "asked for 7") ++gate.warped;
        gate.changed.notify_all();
        if (event == "done with 7" && std::exchange(gate.closed, false))
            gate.opened = gate.changed.wait_for(lock, std::chrono::seconds(30),
                                                [&] { return gate.rectified >= gate.awaited; });
    }
};

auto with(Gate& gate) {
    return [&gate](defrec_context_desc& desc) {
        add_asynchronous(desc);
        desc.log = Gate::log;
        desc.log_user = &gate;
        desc.log_level = DEFREC_LOG_DEBUG;
    };
}

}  // namespace

TEST_CASE(
    "a full queue gives the same bits as frames one by one: failures, lost frames and new "
    "templates included") {
    const std::vector<Step> steps = story();
    const auto check = [&](const char* device, std::initializer_list<uint32_t> full) {
        const std::vector<std::string> expected = play(steps, device, 1);
        for (const uint32_t waiting : full) {
            const std::vector<std::string> results = play(steps, device, waiting);
            for (size_t i = 0; i < steps.size(); ++i) {
                CAPTURE(device);
                CAPTURE(waiting);
                CAPTURE(i);
                CHECK((results[i] == expected[i]));
                if (steps[i].little_room)
                    CHECK(contains(results[i], "samples: the memory has 64 bytes"));
                if (steps[i].refused)
                    CHECK(contains(results[i], "these pixels are refused") ==
                          (std::string(device) == "asynchronous"));
            }
        }
    };
    check("cpu", {3});
    check("asynchronous", {2, 3});
}

TEST_CASE("the device is asked for the next frame's images before it is done with a frame") {
    Gate gate;
    TrackingSession session("asynchronous", 2, nullptr, with(gate));
    const Pair pairs[] = {render(0, 0), render(0.5, 0), render(1, 0)};
    defrec_job jobs[3];
    for (int i = 0; i < 3; ++i) {
        TrackingSession::Frame frame;
        frame.left.pixels = pairs[i].left.data();
        frame.right.pixels = pairs[i].right.data();
        REQUIRE_OK(session.submit(frame, &jobs[i]));
        if (i > 0) continue;
        take_result(jobs[0]);
        const std::lock_guard lock(gate.mutex);
        gate.awaited = gate.rectified + 4;
        gate.closed = true;
    }
    take_result(jobs[1]);
    take_result(jobs[2]);
    CHECK(gate.opened);
}

TEST_CASE(
    "a frame is followed before its images are looked at, and where they turn out to be of no use, "
    "or of two times, it is as if it had not been") {
    constexpr size_t kRoom = 1 << 18, kLittleRoom = 64;
    struct Unlike {
        Pair pair;
        int followed;  // so often by a device that works by itself, of which one may be dropped
        size_t room = kRoom;
        uint32_t flags = 0;
    };
    std::vector<Unlike> frames;
    const auto moved = [&] { return render(0.3 * static_cast<double>(frames.size()), 0, 2); };
    const auto black = [](std::vector<uint8_t>& view) {
        std::fill(view.begin(), view.end(), uint8_t{0});
    };
    const auto add = [&](const Pair& pair, int followed) -> Unlike& {
        frames.push_back({pair, followed});
        return frames.back();
    };
    const auto add_moved = [&](int count) {
        for (int i = 0; i < count; ++i) add(moved(), 1);
    };
    Pair dark;
    black(dark.left);
    black(dark.right);
    add_moved(3);
    add(dark, 1);  // dropped
    add(dark, 0);  // after a frame that was lost
    add_moved(2);
    Pair one_dark = moved();
    black(one_dark.right);
    add(one_dark, 2);
    add_moved(2);
    for (int i = 0; i < 2; ++i) {  // late
        const Pair before = frames.back().pair;
        add(moved(), 2).pair.right = before.right;
    }
    add_moved(1);
    for (int i = 0; i < 4; ++i) add(frames.back().pair, 1);  // frozen
    add_moved(1);
    Pair interlaced = moved();
    const std::vector<uint8_t> other = render(-3, 0, 2).right;
    for (size_t row = 0; row < kHeight; row += 2)
        std::copy_n(&other[row * kWidth], kWidth, &interlaced.right[row * kWidth]);
    add(interlaced, 1);
    add_moved(1);
    add(moved(), 0).room = kLittleRoom;
    add(dark, 0).room = kLittleRoom;
    add_moved(2);
    add(moved(), 1).flags = DEFREC_FRAME_CAPTURE_TEMPLATE;
    add(dark, 0).flags = DEFREC_FRAME_CAPTURE_TEMPLATE;
    add_moved(2);

    Gate gate;
    TrackingSession beside("asynchronous", 2, nullptr, with(gate));
    TrackingSession at_once("cpu");
    for (size_t i = 0; i < frames.size(); ++i) {
        CAPTURE(i);
        TrackingSession::Frame frame;
        frame.left.pixels = frames[i].pair.left.data();
        frame.right.pixels = frames[i].pair.right.data();
        frame.flags = frames[i].flags;
        const int before = gate.warped;
        const std::string given = track(beside, frame, frames[i].room);
        CHECK((given == track(at_once, frame, frames[i].room)));
        CHECK(gate.warped - before == frames[i].followed);
    }
}

TEST_CASE("a tracker that is destroyed with a frame observed ahead ends that frame") {
    for (int run = 0; run < 8; ++run) {
        TrackingSession session(
            "asynchronous", 2, [](auto&, auto& desc) { desc.frames_in_flight = 3; },
            add_asynchronous);
        const Pair pair = render(0, 0);
        TrackingSession::Frame frame;
        frame.left.pixels = pair.left.data();
        frame.right.pixels = pair.right.data();
        defrec_job jobs[3];
        for (defrec_job& job : jobs) REQUIRE_OK(session.submit(frame, &job));
        if (run % 2 != 0) REQUIRE_OK(defrec_job_wait(jobs[0], UINT64_MAX));
        defrec_tracker_destroy(session.tracker);
        session.tracker = nullptr;
        for (defrec_job job : jobs) {
            const defrec_status status = defrec_job_wait(job, UINT64_MAX);
            CHECK((status == DEFREC_OK || status == DEFREC_ERROR_STATE));
            defrec_job_release(job);
        }
    }
}
