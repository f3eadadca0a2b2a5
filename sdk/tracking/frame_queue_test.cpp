// Who waits for whom between the application and the thread that computes.
#include "sdk/tracking/frame_queue.hpp"

#include <doctest/doctest.h>

#include <memory>
#include <thread>

#include "sdk/tracking/test_device.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

struct Queued {
    TestDevice on{"reference"};
    FrameQueue frames{on.device, on.monitor(), *on.rig, on.settings(2)};
    Pair pair;
    int64_t time = 0;

    std::shared_ptr<TrackerJob> submit() { return submit_at(time + 33); }
    std::shared_ptr<TrackerJob> submit_at(int64_t timestamp_ns) {
        FrameInput input;
        input.timestamp_ns = timestamp_ns;
        input.views[0].pixels = pair.left.data();
        input.views[1].pixels = pair.right.data();
        input.views[0].stride = input.views[1].stride = kWidth;
        std::shared_ptr<TrackerJob> job = frames.submit(std::move(input));
        time = timestamp_ns;
        return job;
    }
    defrec_status refused(int64_t timestamp_ns) {
        try {
            submit_at(timestamp_ns);
        } catch (const Error& error) {
            return error.status();
        }
        return DEFREC_OK;
    }
};

}  // namespace

TEST_CASE("row 57: frames are taken in their order, with copies of their pixels, and numbered") {
    Queued queued;
    queued.pair.left[7] = 70;
    const auto first = queued.submit();
    queued.pair.left[7] = 80;
    const auto second = queued.submit();
    CHECK(queued.frames.take() == first.get());
    CHECK(queued.frames.next().job == second.get());
    CHECK(queued.frames.take() == second.get());
    CHECK(queued.frames.next().job == nullptr);
    CHECK(queued.frames.next().may_come);
    CHECK(first->frame == 0);
    CHECK(second->frame == 1);
    CHECK(first->input.views[0].pixels[7] == 70);
    CHECK(second->input.views[0].pixels[7] == 80);
}

TEST_CASE("a frame is refused while every place is taken, until a job is released") {
    Queued queued;
    const auto first = queued.submit();
    queued.submit();
    CHECK(queued.refused(1000) == DEFREC_ERROR_BUSY);
    queued.frames.take()->finish(DEFREC_OK, "");
    CHECK(queued.refused(1000) == DEFREC_ERROR_BUSY);
    first->release();
    CHECK(queued.submit() == first);
    CHECK(first->frame == 2);
}

TEST_CASE("a timestamp that does not grow is refused, and takes no place") {
    Queued queued;
    queued.submit_at(100);
    CHECK(queued.refused(100) == DEFREC_ERROR_ARGUMENT);
    CHECK(queued.refused(99) == DEFREC_ERROR_ARGUMENT);
    CHECK(queued.submit_at(101)->frame == 1);
}

TEST_CASE("a template goes along with the next frame, and no other") {
    Queued queued;
    const auto surface = std::make_shared<const Template>(TemplateData());
    queued.frames.set_template(surface);
    CHECK(queued.frames.template_to_set() == surface);
    CHECK(queued.submit()->template_to_set == surface);
    CHECK(queued.frames.template_to_set() == surface);
    CHECK(queued.submit()->template_to_set == nullptr);
    const auto newer = std::make_shared<const Template>(TemplateData());
    SUBCASE("until it is followed") {
        queued.frames.end_template(*surface);
        CHECK(queued.frames.template_to_set() == nullptr);
    }
    SUBCASE("unless another one was set since") {
        queued.frames.set_template(newer);
        queued.frames.end_template(*surface);
        CHECK(queued.frames.template_to_set() == newer);
    }
    SUBCASE("or the same one again") {
        queued.frames.set_template(surface);
        queued.frames.end_template(*surface);
        CHECK(queued.frames.template_to_set() == surface);
    }
}

TEST_CASE("a queue that is stopped hands out what is in it, and then nothing") {
    Queued queued;
    const auto job = queued.submit();
    queued.frames.stop();
    CHECK(queued.frames.is_stopped());
    CHECK(queued.frames.next().job == nullptr);
    CHECK_FALSE(queued.frames.next().may_come);
    CHECK(queued.frames.take() == job.get());
    CHECK(queued.frames.take() == nullptr);
}

TEST_CASE("a thread that waits is woken by a frame, and by the end") {
    Queued queued;
    std::vector<uint64_t> taken;
    std::thread worker([&] {
        while (TrackerJob* job = queued.frames.take()) {
            taken.push_back(job->frame);
            job->finish(DEFREC_OK, "");
        }
    });
    for (int i = 0; i < 20; ++i) {
        const auto job = queued.submit();
        CHECK(job->wait(UINT64_MAX) == DEFREC_OK);
        job->release();
    }
    queued.frames.stop();
    worker.join();
    CHECK(taken.size() == 20);
}

TEST_CASE("row 91: a timestamp far ahead is refused, and those that go on are taken") {
    Queued queued;
    const int64_t hour = int64_t{3600} * 1000000000;
    CHECK(queued.refused(INT64_MAX) == DEFREC_ERROR_ARGUMENT);  // also as the first
    queued.submit_at(0)->finish(DEFREC_OK, "");
    CHECK(queued.refused(INT64_MAX) == DEFREC_ERROR_ARGUMENT);
    CHECK(queued.refused(INT64_MAX - 23 * hour) == DEFREC_ERROR_ARGUMENT);
    CHECK(queued.refused(1000 * hour) == DEFREC_ERROR_ARGUMENT);
    CHECK(queued.refused(23 * hour) == DEFREC_OK);
}

TEST_CASE(
    "row 128: behind a timestamp that was far ahead none is taken, and the reason says what to "
    "do") {
    const int64_t hour = int64_t{3600} * 1000000000;
    Queued queued;
    queued.submit_at(20 * hour)->finish(DEFREC_OK, "");
    for (int64_t frame = 1; frame <= 3; ++frame) {
        try {
            queued.submit_at(33 * frame);
            FAIL("a timestamp that does not grow was taken");
        } catch (const Error& error) {
            CHECK(error.status() == DEFREC_ERROR_ARGUMENT);
            CHECK(std::string(error.what()).find("another tracker and the template of this one") !=
                  std::string::npos);
        }
    }
    CHECK(queued.refused(21 * hour) == DEFREC_OK);
    CHECK(Queued().refused(33) == DEFREC_OK);
}

TEST_CASE("row 91: a clock that was set is believed with its second frame") {
    Queued queued;
    const int64_t hour = int64_t{3600} * 1000000000;
    queued.submit_at(0);
    CHECK(queued.refused(1000 * hour) == DEFREC_ERROR_ARGUMENT);
    CHECK(queued.refused(1000 * hour) == DEFREC_ERROR_ARGUMENT);  // does not grow
    CHECK(queued.refused(1000 * hour + 1) == DEFREC_OK);
    CHECK(queued.refused(5) == DEFREC_ERROR_ARGUMENT);
}

TEST_CASE("of the queue and an application that let go of a job, the last is told so") {
    auto queued = std::make_unique<Queued>();
    std::shared_ptr<Job> left = queued->submit(), kept = queued->submit();
    for (int i = 0; i < 2; ++i) queued->frames.take()->finish(DEFREC_OK, "");
    left->release();
    CHECK(left->leave(left));
    CHECK(left == nullptr);
    kept->release();
    queued.reset();
    CHECK_FALSE(kept->leave(kept));
    CHECK(kept != nullptr);
}
