// A pipeline without a tracker: what its steps give, how many frames it takes, and what is left
// after a failure.
#include "sdk/tracking/stages/pipeline.hpp"

#include <algorithm>
#include <cstring>
#include <vector>

#include "backends/shared/motion.hpp"
#include "sdk/tracking/test_device.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

std::vector<defrec_motion> no_motion(const TemplateData& data) {
    return std::vector<defrec_motion>(data.nodes.size() / 3,
                                      DualQuaternion<float>::identity().store());
}

// The scene's template, which the pipeline follows from now on.
TemplateData set_template(const TestDevice& on, Pipeline& pipeline) {
    TestFrame frame(on, render(0, 0));
    ObservedFrame observed = pipeline.observe(frame.task());
    std::optional<TemplateData> data = pipeline.capture(observed, false);
    REQUIRE(data);
    pipeline.forget(std::move(observed));
    pipeline.set_template(*data);
    return *data;
}

std::vector<std::string> time_names(const FrameOutput& output) {
    std::vector<std::string> names;
    for (uint32_t i = 0; i < output.time_count; ++i) names.emplace_back(output.times[i].name);
    return names;
}

template <class T>
std::string bytes_of(std::span<T> values) {
    return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}
// All that a followed frame gave but its times.
std::string results_of(const FrameOutput& output) {
    std::string bytes = bytes_of(output.motions) + bytes_of(output.samples) +
                        bytes_of(output.matches) + bytes_of(output.observations) +
                        bytes_of(output.predictions);
    bytes.append(reinterpret_cast<const char*>(output.summary), sizeof *output.summary);
    return bytes;
}

template <class Function>
std::string error_of(const Function& function) {
    try {
        function();
    } catch (const Error& error) {
        return error.what();
    }
    return {};
}

}  // namespace

TEST_CASE("a template is captured from one frame and followed into the next, stage by stage") {
    for (const char* plugin : {"reference", "cpu"}) {
        CAPTURE(plugin);
        const TestDevice on(plugin);
        Pipeline pipeline(on.rig, on.device, on.settings(1));
        const TemplateData data = set_template(on, pipeline);
        TestFrame frame(on, render(1.5, 0));
        frame.memory.fit(data);
        pipeline.finish(pipeline.follow(pipeline.observe(frame.task()), no_motion(data)));
        double moved = 0;
        for (size_t i = 0; i < data.vertices.size(); ++i)
            moved += frame.output().samples[i].position[0] - data.vertices[i].position[0];
        CHECK(moved / static_cast<double>(data.vertices.size()) ==
              doctest::Approx(1.5).epsilon(0.1));
        CHECK(frame.output().summary->features > 0);
        CHECK(frame.output().summary->ransac.inliers > 0);
        CHECK(time_names(frame.output()) ==
              std::vector<std::string>{"upload", "rectify", "stereo", "orb", "match", "ransac",
                                       "lm coarse", "align coarse", "lm middle", "align fine",
                                       "lm fine", "check", "align right", "warp", "download"});
    }
}

TEST_CASE("a smaller quality level leaves stages out, and they have found nothing") {
    const TestDevice on("cpu");
    Pipeline pipeline(on.rig, on.device, on.settings(1));
    const TemplateData data = set_template(on, pipeline);
    TestFrame frame(on, render(1.5, 0));
    frame.memory.fit(data);
    const auto follow = [&](QualityLevel quality_level) {
        RegistrationPlan plan;
        plan.quality_level = quality_level;
        pipeline.finish(pipeline.follow(pipeline.observe(frame.task()), no_motion(data), plan));
        std::vector<std::string> names = time_names(frame.output());
        names.erase(names.begin(), std::find(names.begin(), names.end(), "lm coarse"));
        return names;
    };
    const auto found = [](const auto& records) {
        return std::count_if(records.begin(), records.end(),
                             [](const auto& record) { return record.valid != 0; });
    };
    const FrameOutput& output = frame.output();
    CHECK(follow(QualityLevel::kCoarse) ==
          std::vector<std::string>{"lm coarse", "align coarse", "lm middle", "check", "align right",
                                   "warp", "download"});
    CHECK(found(output.predictions) > 0);
    CHECK(found(output.checks) > 0);
    CHECK(found(output.right_observations) > 0);
    const std::string surface = bytes_of(output.samples);

    CHECK(follow(QualityLevel::kUnchecked) ==
          std::vector<std::string>{"lm coarse", "align coarse", "lm middle", "warp", "download"});
    CHECK(found(output.predictions) > 0);
    CHECK(found(output.checks) == 0);
    CHECK(found(output.check_predictions) == 0);
    CHECK(found(output.right_observations) == 0);
    CHECK((bytes_of(output.samples) == surface));
}

TEST_CASE(
    "a frame that is observed while another is followed has the results of one that comes alone") {
    const TestDevice on("asynchronous");
    const auto follow_two = [&](bool ahead) {
        Pipeline pipeline(on.rig, on.device, on.settings(2));
        const TemplateData data = set_template(on, pipeline);
        TestFrame first(on, render(0.5, 0)), second(on, render(1, 0.5));
        first.memory.fit(data);
        RegisteredFrame registered =
            pipeline.follow(pipeline.observe(first.task()), no_motion(data));
        if (!ahead) pipeline.finish(std::move(registered));
        ObservedFrame observed = pipeline.observe(second.task());
        if (ahead) pipeline.finish(std::move(registered));
        second.memory.fit(data);
        pipeline.finish(pipeline.follow(std::move(observed), first.output().motions));
        return std::pair{results_of(first.output()), results_of(second.output())};
    };
    const auto ahead = follow_two(true), alone = follow_two(false);
    CHECK((ahead.first == alone.first));
    CHECK((ahead.second == alone.second));
    CHECK((ahead.first != ahead.second));
}

TEST_CASE(
    "two frames are observed at a time, or one where frames are not queued or their stages timed") {
    const TestDevice on("cpu");
    TestFrame first(on, render(0, 0)), second(on, render(1, 0)), third(on, render(2, 0));
    Pipeline queued(on.rig, on.device, on.settings(3));
    {
        const ObservedFrame one = queued.observe(first.task());
        CHECK(queued.can_observe());
        ObservedFrame two = queued.observe(second.task());
        CHECK_FALSE(queued.can_observe());
        CHECK(error_of([&] {
                  queued.observe(third.task());
              }).find("2 frames are observed already") != std::string::npos);
        queued.forget(std::move(two));
        CHECK(queued.can_observe());
    }
    for (const TrackerSettings& settings : {on.settings(1), on.settings(3, true)}) {
        Pipeline pipeline(on.rig, on.device, settings);
        CHECK(pipeline.can_observe());
        const ObservedFrame one = pipeline.observe(first.task());
        CHECK_FALSE(pipeline.can_observe());
    }
}

TEST_CASE("a device that is the processor reads a frame's pixels where they are") {
    const TestDevice on("cpu");
    Pipeline pipeline(on.rig, on.device, on.settings(1));
    const TemplateData data = set_template(on, pipeline);
    TestFrame copied(on, render(0.5, 0)), in_place(on, render(0.5, 0));
    const DeviceBuffer buffers[2] = {in_place.pixels[0].as_buffer(),
                                     in_place.pixels[1].as_buffer()};
    const TestFrame other(on, render(2, 1));
    for (size_t view = 0; view < 2; ++view) {
        REQUIRE(buffers[view]);
        in_place.input.views[view].pixels = other.input.views[view].pixels;  // not looked at
        in_place.input.views[view].pixels_in_device = &buffers[view];
    }
    for (TestFrame* frame : {&copied, &in_place}) {
        frame->memory.fit(data);
        pipeline.finish(pipeline.follow(pipeline.observe(frame->task()), no_motion(data)));
    }
    CHECK((results_of(copied.output()) == results_of(in_place.output())));
}

TEST_CASE("host memory is no buffer of a device that works beside the processor") {
    const TestDevice on("asynchronous");
    CHECK_FALSE(HostMemory(on.device, 1024).as_buffer());
    CHECK_FALSE(HostMemory().as_buffer());
}

TEST_CASE("a frame that is forgotten has no features") {
    const TestDevice on("cpu");
    Pipeline pipeline(on.rig, on.device, on.settings(1));
    TestFrame frame(on, render(0, 0));
    ObservedFrame observed = pipeline.observe(frame.task());
    CHECK(frame.output().summary->features > 0);
    pipeline.forget(std::move(observed));
    CHECK(frame.output().summary->features == 0);
    CHECK(pipeline.can_observe());
}

TEST_CASE("a frame that goes no further is waited for: nothing is written into its output later") {
    const TestDevice on("asynchronous");
    TestFrame dropped(on, render(0, 0)), next(on, render(1, 0));
    Pipeline pipeline(on.rig, on.device, on.settings(2));
    { const ObservedFrame observed = pipeline.observe(dropped.task()); }
    dropped.output().summary->features = 54321;
    pipeline.forget(pipeline.observe(next.task()));
    CHECK(dropped.output().summary->features == 54321);
}

TEST_CASE(
    "images that the device refuses leave their frame's place free, and the frame before as it "
    "is") {
    const TestDevice on("asynchronous");
    Pair refused = render(2, 0);
    std::memcpy(refused.left.data(), "refuse", 6);
    TestFrame good(on, render(0.5, 0)), bad(on, refused), again(on, render(0.5, 0));
    Pipeline pipeline(on.rig, on.device, on.settings(2));
    const TemplateData data = set_template(on, pipeline);
    const auto start = no_motion(data);
    good.memory.fit(data);
    RegisteredFrame registered = pipeline.follow(pipeline.observe(good.task()), start);
    CHECK(error_of([&] { pipeline.observe(bad.task()); }).find("these pixels are refused") !=
          std::string::npos);
    CHECK(pipeline.can_observe());
    pipeline.finish(std::move(registered));
    CHECK(error_of([&] { pipeline.observe(bad.task()); }).find("these pixels are refused") !=
          std::string::npos);

    again.memory.fit(data);
    pipeline.finish(pipeline.follow(pipeline.observe(again.task()), start));
    CHECK((results_of(good.output()) == results_of(again.output())));
}

TEST_CASE("a frame that could not be followed, or is taken back, is as it was before") {
    const TestDevice on("asynchronous");
    Pipeline pipeline(on.rig, on.device, on.settings(1));
    const TemplateData data = set_template(on, pipeline);
    CHECK(pipeline.can_follow_speculatively());
    TestFrame alone(on, render(0.5, 0)), again(on, render(0.5, 0));
    alone.memory.fit(data);
    pipeline.finish(pipeline.follow(pipeline.observe(alone.task()), no_motion(data)));

    again.memory.fit(data);
    ObservedFrame frame = pipeline.observe(again.task());
    const std::vector<defrec_motion> too_many(data.nodes.size());
    CHECK(!error_of([&] { pipeline.follow(std::move(frame), too_many); }).empty());
    const std::vector<std::string> observed{"upload", "rectify", "stereo", "orb"};
    CHECK(time_names(again.output()) == observed);
    RegistrationPlan other;
    other.uses_depth = false;
    ObservedFrame back =
        pipeline.take_back(pipeline.follow(std::move(frame), alone.output().motions, other));
    CHECK(time_names(again.output()) == observed);
    pipeline.finish(pipeline.follow(std::move(back), no_motion(data)));
    CHECK((results_of(alone.output()) == results_of(again.output())));
    CHECK(time_names(alone.output()) == time_names(again.output()));
}

TEST_CASE(
    "a frame that is observed and followed at once is as one that is observed first, and can be "
    "taken back; where that fails, its place is free") {
    const TestDevice on("asynchronous");
    Pipeline pipeline(on.rig, on.device, on.settings(1));
    const TemplateData data = set_template(on, pipeline);
    TestFrame one(on, render(0.5, 0)), other(on, render(0.5, 0));
    one.memory.fit(data);
    pipeline.finish(pipeline.follow(pipeline.observe(one.task()), no_motion(data)));
    other.memory.fit(data);
    const std::vector<defrec_motion> too_many(data.nodes.size());
    CHECK(!error_of([&] { pipeline.observe_and_follow(other.task(), too_many, {}); }).empty());
    CHECK(pipeline.can_observe());
    pipeline.finish(pipeline.observe_and_follow(other.task(), no_motion(data), {}));
    CHECK((results_of(one.output()) == results_of(other.output())));
    CHECK(time_names(one.output()) == time_names(other.output()));

    RegistrationPlan without_depth;
    without_depth.uses_depth = false;
    ObservedFrame back = pipeline.take_back(
        pipeline.observe_and_follow(other.task(), no_motion(data), without_depth));
    CHECK(time_names(other.output()) ==
          std::vector<std::string>{"upload", "rectify", "stereo", "orb"});
    pipeline.finish(pipeline.follow(std::move(back), no_motion(data)));
    CHECK((results_of(one.output()) == results_of(other.output())));
}

TEST_CASE(
    "what is followed speculatively costs the host no time: not where it computes, or waits") {
    const TestDevice beside("asynchronous"), at_once("cpu");
    const auto can = [](const TestDevice& on, bool timed) {
        Pipeline pipeline(on.rig, on.device, on.settings(1, timed));
        set_template(on, pipeline);
        return pipeline.can_follow_speculatively();
    };
    CHECK(can(beside, false));
    CHECK_FALSE(can(beside, true));
    CHECK_FALSE(can(at_once, false));
}

TEST_CASE("nothing is followed without a template") {
    const TestDevice on("cpu");
    Pipeline pipeline(on.rig, on.device, on.settings(1));
    TestFrame frame(on, render(0, 0));
    CHECK(error_of([&] {
              pipeline.follow(pipeline.observe(frame.task()), {});
          }).find("no template") != std::string::npos);
    CHECK(error_of([&] {
              pipeline.observe_and_follow(frame.task(), {}, {});
          }).find("no template") != std::string::npos);
    CHECK(pipeline.can_observe());
}

TEST_CASE("exchanged views are told from views in their order") {
    const TestDevice on("cpu");
    Pair pair = render(0, 0);
    TestFrame right_order(on, pair);
    std::swap(pair.left, pair.right);
    TestFrame exchanged(on, pair);
    Pipeline pipeline(on.rig, on.device, on.settings(1));
    for (TestFrame* frame : {&right_order, &exchanged}) {
        ObservedFrame observed = pipeline.observe(frame->task());
        CHECK(pipeline.capture(observed, false).has_value() == (frame == &right_order));
        CHECK(pipeline.views_look_swapped(observed) == (frame == &exchanged));
    }
}

TEST_CASE("a template that is asked for is searched for wherever the rig can have one") {
    const TestDevice on("cpu");
    Pipeline pipeline(on.rig, on.device, on.settings(1));
    // A plane across the view, the disparity in px.
    const auto plane = [&](int disparity) {
        Pair pair = render(0, 0);
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
                pair.right[static_cast<size_t>(y * kWidth + x)] = pair.left[static_cast<size_t>(
                    y * kWidth + std::min(x + disparity, kWidth - 1))];
        return pair;
    };
    const auto captured = [&](const Pair& pair, bool again) {
        TestFrame frame(on, pair);
        ObservedFrame observed = pipeline.observe(frame.task());
        std::optional<TemplateData> data = pipeline.capture(observed, again);
        pipeline.forget(std::move(observed));
        return data;
    };
    const std::optional<TemplateData> near = captured(plane(45), false);
    REQUIRE(near);
    pipeline.set_template(*near);
    CHECK_FALSE(captured(plane(6), true));  // where the template's tissue was there is none
    // One that is not found leaves the template's range.
    CHECK_FALSE(captured(Pair(), false));
    CHECK(captured(plane(45), true));
    CHECK_FALSE(captured(plane(6), true));
    CHECK(captured(plane(6), false));
}
