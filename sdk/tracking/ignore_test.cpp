// Masks of pixels to ignore, given to the tracker through the C API: sound ones of several kinds,
// the same inverted, and some that leave nothing.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "sdk/tracking/test_pair_session.hpp"

using namespace defrec::test;
using Session = PairSession;

namespace {

using Mask = std::vector<uint8_t>;
using IsMarked = std::function<bool(int x, int y)>;

Mask mask_of(const IsMarked& is_marked, uint8_t marked = 255) {
    Mask mask(kWidth * kHeight);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            if (is_marked(x, y)) mask[static_cast<size_t>(y * kWidth + x)] = marked;
    return mask;
}

Mask inverted(Mask mask) {
    for (uint8_t& value : mask) value = value == 0 ? 255 : 0;
    return mask;
}

bool is_outside_aperture(int x, int y) {
    const int dx = x - kWidth / 2, dy = y - kHeight / 2;
    return dx * dx + dy * dy > 115 * 115;
}

bool is_border(int x, int y) { return x < 24 || x >= kWidth - 24 || y < 16 || y >= kHeight - 16; }

// Letters of two rows.
bool is_text(int x, int y) {
    const bool in_row = (y >= 10 && y < 24) || (y >= 214 && y < 228);
    return in_row && x >= 20 && x < 200 && x % 12 < 9;
}

bool is_instrument(int x, int y) { return x > 170 && y > 90 + x / 4 && y < 130 + x / 4; }

// A recorder puts this over the tissue, in both views.
Pair dressed(Pair pair, const IsMarked& is_marked, const std::function<uint8_t(int, int)>& gray) {
    for (std::vector<uint8_t>* image : {&pair.left, &pair.right})
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
                if (is_marked(x, y)) (*image)[static_cast<size_t>(y * kWidth + x)] = gray(x, y);
    return pair;
}

uint8_t black(int, int) { return 0; }

uint8_t letters(int x, int y) { return (x / 2 * 7 + y / 2 * 5) % 3 == 0 ? 230 : 10; }

uint8_t metal(int x, int y) {
    return static_cast<uint8_t>(120 + std::lround(30 * smooth_noise(0.1 * x, 0.1 * y, 9)));
}

struct Kind {
    const char* name;
    IsMarked is_marked;
    std::function<uint8_t(int, int)> gray;
    Pair view(double dx) const { return dressed(render(dx, 0), is_marked, gray); }
};

const std::vector<Kind>& kinds() {
    static const std::vector<Kind> all = {
        {"round aperture", is_outside_aperture, black},
        {"black border", is_border, black},
        {"burnt-in text", is_text, letters},
        {"instrument", is_instrument, metal},
    };
    return all;
}

void check_refused(Session& session, const Pair& pair, const Mask& mask, uint32_t flags = 0) {
    defrec_job job = nullptr;
    REQUIRE_OK(session.submit(pair, &job, &mask, flags));
    CHECK(defrec_job_wait(job, UINT64_MAX) == DEFREC_ERROR_ARGUMENT);
    const std::string text = defrec_last_error();
    CHECK_MESSAGE(text.find("ignore hides the tissue") != std::string::npos, text);
    CHECK(text.find("inverted") != std::string::npos);
    defrec_result result;
    DEFREC_INIT(&result);
    CHECK(defrec_job_result(job, &result) == DEFREC_ERROR_ARGUMENT);
    defrec_job_release(job);
}

void check_followed(Session& session, const Kind& kind, const Mask* mask) {
    const Session::Frame first = session.track(kind.view(0), mask);
    CHECK(first.state == DEFREC_TRACKING);
    const Session::Frame second = session.track(kind.view(1), mask);
    CHECK(usable(second.state));
    CHECK(std::abs(second.shift[0] - 1) < 0.25);
}

}  // namespace

TEST_CASE("row 160: apertures, borders, text and instruments are followed, masked or not") {
    const Mask nothing(kWidth * kHeight);
    for (const Kind& kind : kinds()) {
        CAPTURE(kind.name);
        const Mask mask = mask_of(kind.is_marked), faint = mask_of(kind.is_marked, 1);
        for (const Mask* each : {static_cast<const Mask*>(nullptr), &nothing, &mask, &faint}) {
            Session session;
            check_followed(session, kind, each);
        }
    }
}

TEST_CASE("row 160: an inverted mask is refused, and the sound one after it gives a template") {
    for (const Kind& kind : kinds()) {
        CAPTURE(kind.name);
        const Mask mask = mask_of(kind.is_marked);
        Session session;
        for (int i = 0; i < 2; ++i) check_refused(session, kind.view(0), inverted(mask));
        check_followed(session, kind, &mask);
    }
}

TEST_CASE("row 160: a mask over all of the picture, or all of its texture, is refused") {
    Session session;
    check_refused(session, render(0, 0), Mask(kWidth * kHeight, 255));
    // A picture in a picture: what is left is a gray frame, and flickers as a camera does.
    const auto is_frame = [](int x, int y) { return x < 90 || x >= 230 || y < 20 || y >= 220; };
    const Pair pair = dressed(render(0, 0), is_frame, [](int x, int y) {
        return static_cast<uint8_t>(90 + (x * 31 + y * 17) % 2);
    });
    check_refused(session, pair, mask_of([&](int x, int y) { return !is_frame(x, y); }));
    CHECK(session.track(render(0, 0)).state == DEFREC_TRACKING);
}

TEST_CASE("row 160: a frame asked for with an inverted mask leaves the template as it is") {
    Session session;
    session.track(render(0, 0));
    check_refused(session, render(0.3, 0), Mask(kWidth * kHeight, 255),
                  DEFREC_FRAME_CAPTURE_TEMPLATE);
    const Session::Frame frame = session.track(render(0.6, 0));
    CHECK(usable(frame.state));
    CHECK(std::abs(frame.shift[0] - 0.6) < 0.2);
}

TEST_CASE("row 160: tissue that is followed is lost while a mask hides it, which is no mistake") {
    Session session;
    const Mask all(kWidth * kHeight, 255);
    session.track(render(0, 0));
    CHECK(session.track(render(0.3, 0), &all).state == DEFREC_LOST);
    CHECK(usable(session.track(render(0.6, 0)).state));
}

TEST_CASE("row 160: a frame without depth is no mistake of its mask") {
    Session session;
    const Mask half = mask_of([](int x, int) { return x < kWidth / 2; });
    const Pair gray{std::vector<uint8_t>(kWidth * kHeight, 120),
                    std::vector<uint8_t>(kWidth * kHeight, 120)};
    CHECK(session.track(gray, &half).state == DEFREC_INITIALISING);
    const Session::Frame other = session.track({render(0, 0).left, render(40, 30).right}, &half);
    CHECK(other.state == DEFREC_INITIALISING);
}

TEST_CASE("row 160: a mask in memory of the device is refused as well") {
    Session session;
    alignas(64) static uint8_t pixels[kWidth * kHeight];
    std::fill(std::begin(pixels), std::end(pixels), uint8_t{255});
    defrec_memory_desc desc;
    DEFREC_INIT(&desc);
    desc.kind = DEFREC_MEMORY_HOST;
    desc.address = pixels;
    desc.size = sizeof pixels;
    defrec_memory memory = nullptr;
    REQUIRE_OK(defrec_memory_import(session.tracker, &desc, &memory));
    const Pair pair = render(0, 0);
    TrackingSession::Frame frame;
    frame.left.pixels = pair.left.data();
    frame.right.pixels = pair.right.data();
    frame.ignore.memory = memory;
    defrec_job job = nullptr;
    REQUIRE_OK(session.TrackingSession::submit(frame, &job));
    CHECK(defrec_job_wait(job, UINT64_MAX) == DEFREC_ERROR_ARGUMENT);
    defrec_job_release(job);
    defrec_memory_release(memory);
}
