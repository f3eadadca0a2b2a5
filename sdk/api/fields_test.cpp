// Interlaced video through the C API: which field is first, each field tracked at its time, and
// what is refused.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_film.hpp"
#include "sdk/testing/test_frames.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

constexpr int kFilmWidth = 640, kFilmHeight = 360, kFilmed = 12;  // images

enum class FieldOrder { kTopFirst, kBottomFirst };

using Pixels = std::vector<uint8_t>;

// Rows of the film's present picture into an image, those of one field.
void weave(const Pixels& picture, bool is_bottom, Pixels& image) {
    image.resize(picture.size());
    const ptrdiff_t row = ptrdiff_t{3} * kFilmWidth;
    for (int y = is_bottom ? 1 : 0; y < kFilmHeight; y += 2)
        std::copy_n(picture.begin() + y * row, row, image.begin() + y * row);
}

// A film in images of two fields.
class InterlacedFilm {
  public:
    InterlacedFilm(const std::string& scene, FieldOrder order)
        : film(scene, kFilmWidth, kFilmHeight, kFilmed, 1, 2), order_(order) {}

    // To the next field. An image is whole once its later one is there.
    void advance() {
        film.advance(0.5);
        is_later_ = !is_later_;
        is_bottom = is_later_ == (order_ == FieldOrder::kTopFirst);
        weave(film.left_bgr(), is_bottom, left);
        weave(film.right_bgr(), is_bottom, right);
    }
    void advance_image() {
        advance();
        advance();
    }

    cli::Film film;
    Pixels left, right;  // the other field's rows are of half a frame before
    bool is_bottom = false;

  private:
    FieldOrder order_;
    bool is_later_ = true;
};

uint32_t scan_of(const Pixels& earlier, const Pixels& later) {
    defrec_image images[2];
    for (int i = 0; i < 2; ++i) {
        DEFREC_INIT(&images[i]);
        images[i].format = DEFREC_FORMAT_BGR8;
        images[i].width = kFilmWidth;
        images[i].height = kFilmHeight;
        images[i].pixels = (i == 0 ? earlier : later).data();
    }
    uint32_t scan = 99;
    REQUIRE_OK(defrec_detect_scan(&images[0], &images[1], &scan));
    return scan;
}

struct FieldErrors {
    std::vector<double> visible;  // mm, of all fields
    uint32_t reasons = 0;
    int observed = 0, points = 0;
};

// Each field is submitted as it is filmed: rows of the other one are of another time.
FieldErrors track_fields(const std::string& scene, FieldOrder order) {
    InterlacedFilm filmed(scene, order);
    TrackingSession session("cpu", 2, [&](defrec_rig_desc& rig, defrec_tracker_desc& tracker) {
        describe_rig(filmed.film.scene().rig, kFilmWidth, kFilmHeight, rig);
        tracker.format = DEFREC_FORMAT_BGR8;
    });
    LiftedPoints lifted;
    FieldErrors errors;
    for (int field = 0; field < 2 * kFilmed; ++field) {
        filmed.advance();
        TrackingSession::Frame frame;
        frame.left.pixels = filmed.left.data();
        frame.right.pixels = filmed.right.data();
        frame.field = filmed.is_bottom ? DEFREC_FIELD_BOTTOM : DEFREC_FIELD_TOP;
        defrec_job job = nullptr;
        REQUIRE_OK(session.submit(frame, &job));
        REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
        if (field == 0) {
            defrec_template surface = nullptr;
            REQUIRE_OK(defrec_job_get_template(job, &surface));
            lifted = lift_film(surface, filmed.film);
            defrec_template_release(surface);
        }
        defrec_result result;
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        errors.reasons |= result.reasons;
        const size_t count = lifted.of_film.size();
        std::vector<double> xyz(3 * count), expected(count);
        std::vector<uint8_t> status(count);
        REQUIRE_OK(defrec_job_warp_points(job, lifted.xyz.data(), count, xyz.data(), status.data(),
                                          expected.data()));
        defrec_job_release(job);
        for (size_t p = 0; p < count; ++p) {
            const cli::Film::Truth truth = filmed.film.truth(lifted.of_film[p]);
            if (!truth.visible) continue;
            ++errors.points;
            errors.observed += status[p] == DEFREC_POINT_OBSERVED;
            errors.visible.push_back(
                (Eigen::Map<const Eigen::Vector3d>(&xyz[3 * p]) - truth.position).norm());
        }
    }
    return errors;
}

double quantile(std::vector<double> values, double share) {
    const auto place = static_cast<ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + place, values.end());
    return values[static_cast<size_t>(place)];
}

}  // namespace

TEST_CASE("which field is first is told of moving tissue and of a moving camera") {
    for (const std::string scene : {"heartbeat", "slide"})
        for (const FieldOrder order : {FieldOrder::kTopFirst, FieldOrder::kBottomFirst}) {
            CAPTURE(scene);
            InterlacedFilm filmed(scene, order);
            const uint32_t expected = order == FieldOrder::kTopFirst ? DEFREC_SCAN_TOP_FIRST
                                                                     : DEFREC_SCAN_BOTTOM_FIRST,
                           other = order == FieldOrder::kTopFirst ? DEFREC_SCAN_BOTTOM_FIRST
                                                                  : DEFREC_SCAN_TOP_FIRST;
            int right = 0;
            Pixels before;
            for (int i = 0; i < kFilmed; ++i) {
                filmed.advance_image();
                if (i > 0) {
                    const uint32_t scan = scan_of(before, filmed.left);
                    CHECK(scan != other);
                    CHECK(scan != DEFREC_SCAN_PROGRESSIVE);
                    right += scan == expected;
                }
                before = filmed.left;
            }
            CHECK(right > kFilmed / 2);
        }
}

TEST_CASE(
    "progressive video is not taken for interlaced, and noise and a still picture tell nothing") {
    for (const std::string scene : {"heartbeat", "slide"}) {
        CAPTURE(scene);
        cli::Film film(scene, kFilmWidth, kFilmHeight, kFilmed, 1, 2);
        int right = 0;
        Pixels before;
        for (int i = 0; i < kFilmed; ++i) {
            film.advance();
            if (i > 0) {
                const uint32_t scan = scan_of(before, film.left_bgr());
                CHECK((scan == DEFREC_SCAN_PROGRESSIVE || scan == DEFREC_SCAN_UNKNOWN));
                right += scan == DEFREC_SCAN_PROGRESSIVE;
            }
            before = film.left_bgr();
        }
        CHECK(right > kFilmed / 2);
        CHECK(scan_of(before, before) == DEFREC_SCAN_UNKNOWN);
        std::mt19937 random(7);
        std::normal_distribution<float> noise(0, 4);
        Pixels again = before;
        for (uint8_t& value : again)
            value = static_cast<uint8_t>(
                std::clamp(static_cast<float>(value) + noise(random), 0.0f, 255.0f));
        CHECK(scan_of(before, again) == DEFREC_SCAN_UNKNOWN);
    }
    std::mt19937 random(8);
    Pixels noise[2];
    for (Pixels& pixels : noise) {
        pixels.resize(size_t{3} * kFilmWidth * kFilmHeight);
        for (uint8_t& value : pixels) value = static_cast<uint8_t>(random());
    }
    CHECK(scan_of(noise[0], noise[1]) == DEFREC_SCAN_UNKNOWN);
}

TEST_CASE("images that cannot be compared are refused") {
    SmallFrame frame;
    uint32_t scan = 99;
    const auto refuses = [&](const defrec_image* earlier, const defrec_image* later,
                             uint32_t* result, const char* words) {
        CHECK(defrec_detect_scan(earlier, later, result) == DEFREC_ERROR_ARGUMENT);
        CHECK(contains(defrec_last_error(), words));
    };
    refuses(nullptr, &frame.image, &scan, "earlier");
    refuses(&frame.image, nullptr, &scan, "later");
    refuses(&frame.image, &frame.image, nullptr, "scan is NULL");
    defrec_image other = frame.image;
    other.height = 47;
    refuses(&frame.image, &other, &scan, "48 to 8192");
    std::vector<uint8_t> larger(64 * 50);
    other.height = 50;
    other.pixels = larger.data();
    refuses(&frame.image, &other, &scan, "64 x 50 pixels of format 1 given, earlier has 64 x 48");
    CHECK(scan == 99);
}

TEST_CASE("row 153: each field of interlaced video is tracked at its time") {
    for (const std::string scene : {"heartbeat", "slide"})
        for (const FieldOrder order : {FieldOrder::kTopFirst, FieldOrder::kBottomFirst}) {
            CAPTURE(scene);
            CAPTURE(order == FieldOrder::kTopFirst);
            const FieldErrors errors = track_fields(scene, order);
            CHECK(quantile(errors.visible, 0.5) < 0.12);
            CHECK(quantile(errors.visible, 0.95) < 0.5);
            CHECK(10 * errors.observed > 8 * errors.points);
            CHECK((errors.reasons & (DEFREC_REASON_INTERLACED | DEFREC_REASON_CALIBRATION |
                                     DEFREC_REASON_VIEW_LATE | DEFREC_REASON_FROZEN)) == 0);
        }
}
