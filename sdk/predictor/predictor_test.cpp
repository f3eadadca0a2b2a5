// Predictions against the truth of a motion that is known, and what is forgotten when.
#include "sdk/predictor/predictor.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>

#include "sdk/base/util/error.hpp"

using namespace defrec;

namespace {

constexpr double kTau = 6.283185307179586;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Tissue that beats 72 times a minute, with two harmonics, and breathes 15 times; mm.
Eigen::Vector3d beating(std::size_t point, double time) {
    const double place = static_cast<double>(point), beat = kTau * 1.2 * time - 0.05 * place;
    const Eigen::Vector3d rest(3 * place, 50 - place, 90);
    return rest +
           (1 + 0.02 * place) * Eigen::Vector3d(std::sin(beat), 0.6 * std::sin(2 * beat + 1),
                                                0.8 * std::cos(3 * beat)) +
           Eigen::Vector3d(0, 2, 3) * std::sin(kTau * 0.25 * time);
}

using Motion = std::function<Eigen::Vector3d(std::size_t, double)>;

// Errors of predictions and of the last frame's positions, mm.
struct Errors {
    std::vector<double> predicted, last, expected;

    static double median(std::vector<double> values) {
        REQUIRE(!values.empty());
        std::sort(values.begin(), values.end());
        return values[values.size() / 2];
    }
    double ratio() const { return median(predicted) / median(last); }
    double within(double times) const {
        std::size_t count = 0;
        for (std::size_t i = 0; i < predicted.size(); ++i)
            count += predicted[i] <= times * expected[i] ? 1 : 0;
        return static_cast<double>(count) / static_cast<double>(predicted.size());
    }
};

// Points that are followed, and what is predicted of them.
class Film {
  public:
    explicit Film(std::size_t points = 40, Motion motion = beating)
        : predictor(points),
          xyz(3 * points),
          error(points, 0.05),
          status(points, DEFREC_POINT_OBSERVED),
          motion_(std::move(motion)) {}

    static int64_t ns(double time) { return std::llround(1e9 * time); }

    void add(double time, double noise = 0) {
        std::normal_distribution<double> normal(0, 1);
        for (std::size_t point = 0; point < status.size(); ++point)
            for (std::size_t axis = 0; axis < 3; ++axis)
                xyz[3 * point + axis] =
                    motion_(point, time)[static_cast<Eigen::Index>(axis)] + noise * normal(random_);
        predictor.add_frame(frame(time));
    }
    FollowedPoints frame(double time) const {
        return {ns(time), is_followed, epoch, xyz.data(), status.data(), error.data()};
    }
    void predict(double time) {
        const std::size_t points = status.size();
        out.resize(3 * points);
        out_error.resize(points);
        out_status.resize(points);
        basis.resize(points);
        predictor.predict(ns(time),
                          {out.data(), out_status.data(), out_error.data(), basis.data()});
    }
    Eigen::Vector3d predicted(std::size_t point) const {
        return Eigen::Map<const Eigen::Vector3d>(&out[3 * point]);
    }
    std::size_t count(Basis wanted) const {
        return static_cast<std::size_t>(
            std::count(basis.begin(), basis.end(), static_cast<uint8_t>(wanted)));
    }
    // The prediction `ahead` s after the last frame, at `time`.
    void judge(double time, double ahead, Errors& errors) {
        predict(time + ahead);
        for (std::size_t point = 0; point < status.size(); ++point) {
            const Eigen::Vector3d truth = motion_(point, time + ahead);
            errors.predicted.push_back((predicted(point) - truth).norm());
            errors.last.push_back(
                (Eigen::Map<const Eigen::Vector3d>(&xyz[3 * point]) - truth).norm());
            errors.expected.push_back(out_error[point]);
        }
    }
    // Frames at these times; judged from 2 s on.
    Errors run(const std::vector<double>& times, double ahead, double noise = 0) {
        Errors errors;
        for (const double time : times) {
            add(time, noise);
            if (time >= 2) judge(time, ahead, errors);
        }
        return errors;
    }

    Predictor predictor;
    std::vector<double> xyz, error, out, out_error;
    std::vector<uint8_t> status, out_status, basis;
    bool is_followed = true;
    uint32_t epoch = 1;

  private:
    Motion motion_;
    std::mt19937 random_{7};
};

std::vector<double> regular(double rate, double seconds, double start = 0) {
    std::vector<double> times;
    for (int i = 0; i < rate * seconds; ++i) times.push_back(start + i / rate);
    return times;
}

// Times that are up to `share` of an interval early or late, and every `missing`th is left out.
std::vector<double> irregular(double rate, double seconds, double share, int missing) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> late(-share, share);
    std::vector<double> times;
    for (int i = 0; i < rate * seconds; ++i)
        if (missing == 0 || i % missing != missing - 1)
            times.push_back((i + 1 + late(random)) / rate);
    return times;
}

std::string refusal(const std::function<void()>& call, defrec_status expected) {
    try {
        call();
    } catch (const Error& error) {
        CHECK(error.status() == expected);
        return error.what();
    }
    return "nothing was refused";
}

}  // namespace

TEST_CASE("beat and breath: a small part of the last frame's error, at every rate and delay") {
    for (const double rate : {15.0, 25.0, 29.97, 30.0, 50.0, 60.0, 120.0, 240.0})
        for (const double ahead : {0.0333, 0.05, 0.0666, 0.1}) {
            CAPTURE(rate);
            CAPTURE(ahead);
            const Errors errors = Film().run(regular(rate, 4), ahead);
            CHECK(errors.ratio() < 0.15);
            CHECK(errors.within(3) > 0.985);
        }
}

TEST_CASE("noise of the tracker: half of the last frame's error at most, and errors cover") {
    for (const double ahead : {0.0333, 0.0666}) {
        const Errors errors = Film(200).run(regular(30, 8), ahead, 0.05);
        CAPTURE(ahead);
        CHECK(errors.ratio() < 0.5);
        CHECK(errors.within(1) > 0.55);
        CHECK(errors.within(1) < 0.97);
        CHECK(errors.within(2) > 0.93);
        CHECK(errors.within(3) > 0.985);
    }
}

TEST_CASE("times that are not even, and frames that are missing") {
    for (const double rate : {30.0, 60.0}) {
        CAPTURE(rate);
        CHECK(Film().run(irregular(rate, 5, 0.15, 0), 0.0666).ratio() < 0.2);
        CHECK(Film().run(irregular(rate, 5, 0, 10), 0.0666).ratio() < 0.2);
        CHECK(Film().run(irregular(rate, 5, 0.1, 7), 0.05).ratio() < 0.25);
        CHECK(Film().run(irregular(rate, 6, 0, 3), 0.05).ratio() < 0.25);
    }
}

TEST_CASE("frames that come too fast to be kept for long are predicted all the same") {
    for (const double rate : {400.0, 2000.0, 20000.0}) {
        CAPTURE(rate);
        Film film;
        Errors errors;
        for (const double time : regular(rate, 0.5)) {
            film.add(time);
            if (time > 0.45) film.judge(time, 0.0333, errors);
        }
        CHECK(errors.ratio() < 1.2);
        CHECK(film.count(Basis::kLearned) == 0);
    }
}

TEST_CASE("another rate is learned anew") {
    Film film;
    for (const double time : regular(30, 3)) film.add(time);
    Errors errors;
    for (const double time : regular(120, 3, 3)) {
        film.add(time);
        if (time > 4.5) film.judge(time, 0.0666, errors);
    }
    CHECK(errors.ratio() < 0.1);
}

TEST_CASE("at the frame's own time positions are the frame's; between steps they are between") {
    Film film;
    for (const double time : regular(30, 3)) film.add(time);
    const double now = 3 - 1.0 / 30;
    film.predict(now);
    for (std::size_t i = 0; i < film.out.size(); ++i)
        CHECK(film.out[i] == doctest::Approx(film.xyz[i]).epsilon(1e-12));
    for (std::size_t point = 0; point < film.error.size(); ++point)
        CHECK(film.out_error[point] == film.error[point]);
    for (const double ahead : {0.004, 0.017, 0.041, 0.059, 0.083}) {
        film.predict(now + ahead);
        CHECK((film.predicted(5) - beating(5, now + ahead)).norm() < 0.1);
    }
}

TEST_CASE("the expected error is that of the frame, and grows with time") {
    Film film;
    for (const double time : regular(30, 3)) film.add(time, 0.05);
    const double now = 3 - 1.0 / 30;
    std::vector<double> before(film.error);
    for (int ms = 0; ms <= 100; ms += 5) {
        film.predict(now + ms * 1e-3);
        for (std::size_t point = 0; point < before.size(); ++point)
            CHECK(film.out_error[point] >= before[point]);
        before = film.out_error;
    }
    CHECK(before[0] > 2 * film.error[0]);
    film.error.assign(film.error.size(), 40);
    film.add(3);
    film.predict(3.1);
    CHECK(film.out_error[0] == 40);
}

TEST_CASE("the first frames: no motion, then a velocity, then what was learned") {
    Film film(10, [](std::size_t point, double time) {
        return Eigen::Vector3d(static_cast<double>(point) + 20 * time, 0, 80);
    });
    film.add(0);
    film.predict(0.05);
    CHECK(film.count(Basis::kLast) == 10);
    CHECK(film.out_error[0] == doctest::Approx(1.5));
    film.add(1 / 30.0);
    film.predict(1 / 30.0 + 0.05);
    CHECK(film.count(Basis::kVelocity) == 10);
    CHECK(film.predicted(3).x() > film.xyz[9]);
    for (int i = 2; i < 24; ++i) film.add(i / 30.0);
    film.predict(23 / 30.0 + 0.05);
    CHECK(film.count(Basis::kLearned) == 0);
    for (int i = 24; i < 40; ++i) film.add(i / 30.0);
    film.predict(39 / 30.0 + 0.05);
    CHECK(film.count(Basis::kLearned) == 10);
    CHECK((film.predicted(3) - Eigen::Vector3d(3 + 20 * (39 / 30.0 + 0.05), 0, 80)).norm() < 0.01);
}

TEST_CASE("tissue at rest: noise is not taken for motion") {
    Film film(100, [](std::size_t point, double) {
        return Eigen::Vector3d(static_cast<double>(point), 0, 80);
    });
    const Errors errors = film.run(regular(30, 5), 0.0666, 0.1);
    CHECK(errors.ratio() < 1.05);
    CHECK(errors.within(2) > 0.93);
}

TEST_CASE("row 209: a jump of all points is no velocity") {
    const Motion jumping = [](std::size_t point, double time) {
        return Eigen::Vector3d(beating(point, time) + Eigen::Vector3d(time >= 2.99 ? 12 : 0, 0, 0));
    };
    Film film(40, jumping);
    for (int i = 0; i < 90; ++i) film.add(i / 30.0);
    film.predict(89 / 30.0 + 0.05);
    CHECK(film.count(Basis::kLearned) == 40);
    film.add(3);
    film.predict(3.0666);
    CHECK(film.count(Basis::kLast) == 40);
    for (std::size_t point = 0; point < 40; ++point) {
        CHECK((film.predicted(point) - jumping(point, 3)).norm() < 1e-9);
        CHECK(film.out_error[point] > 5);
    }
    Errors errors;
    for (int i = 91; i < 130; ++i) {
        film.add(i / 30.0);
        if (i > 117) film.judge(i / 30.0, 0.0666, errors);
    }
    CHECK(errors.ratio() < 0.1);
}

TEST_CASE("row 209: a jump of one point ends its motion alone") {
    Film film(40, [](std::size_t point, double time) {
        return Eigen::Vector3d(beating(point, time) +
                               Eigen::Vector3d(0, point == 7 && time >= 2.99 ? 30 : 0, 0));
    });
    for (int i = 0; i <= 90; ++i) film.add(i / 30.0);
    film.predict(3.0333);
    CHECK(film.count(Basis::kLast) == 1);
    CHECK(film.basis[7] == DEFREC_PREDICTED_LAST);
    CHECK(film.count(Basis::kLearned) == 39);
}

TEST_CASE("rows 208-209: motion is forgotten over a gap, a lost frame and another epoch") {
    for (const std::string cause : {"gap", "lost", "epoch"}) {
        CAPTURE(cause);
        Film film;
        for (int i = 0; i < 90; ++i) film.add(i / 30.0);
        double now = 3;
        if (cause == "gap") now = 3.2;
        if (cause == "epoch") film.epoch = 2;
        if (cause == "lost") {
            film.is_followed = false;
            film.add(now);
            film.predict(now + 0.05);
            CHECK(std::count(film.out_status.begin(), film.out_status.end(),
                             DEFREC_POINT_UNKNOWN) == 40);
            CHECK(film.out == film.xyz);
            film.is_followed = true;
            now += 1 / 30.0;
        }
        film.add(now);
        film.predict(now + 0.05);
        CHECK(film.count(Basis::kLast) == 40);
        CHECK(film.out_error[0] > 0.5);
        film.add(now + 1 / 30.0);
        film.predict(now + 0.05);
        CHECK(film.count(Basis::kVelocity) == 40);
        Errors errors;
        for (int i = 2; i < 40; ++i) {
            film.add(now + i / 30.0);
            if (i > 27) film.judge(now + i / 30.0, 0.0666, errors);
        }
        CHECK(film.count(Basis::kLearned) == 40);
        CHECK(errors.ratio() < 0.1);
    }
}

TEST_CASE("an unknown point stays unknown, as it was given; seen again it begins anew") {
    Film film;
    for (int i = 0; i < 90; ++i) film.add(i / 30.0);
    film.status[4] = DEFREC_POINT_UNKNOWN;
    film.error[4] = kNaN;
    film.add(3);
    film.predict(3.05);
    CHECK(film.out_status[4] == DEFREC_POINT_UNKNOWN);
    CHECK(film.predicted(4) == beating(4, 3));
    CHECK(std::isnan(film.out_error[4]));
    CHECK(film.out_status[5] == DEFREC_POINT_OBSERVED);
    CHECK(film.basis[5] == DEFREC_PREDICTED_LEARNED);
    film.status[4] = DEFREC_POINT_EXTRAPOLATED;
    film.error[4] = 0.3;
    film.add(3 + 1 / 30.0);
    film.predict(3.08);
    CHECK(film.out_status[4] == DEFREC_POINT_EXTRAPOLATED);
    CHECK(film.basis[4] == DEFREC_PREDICTED_LAST);
    CHECK(film.out_error[4] > film.out_error[5]);
    film.add(3 + 2 / 30.0);
    film.predict(3.1);
    CHECK(film.basis[4] == DEFREC_PREDICTED_VELOCITY);
}

TEST_CASE("the same frames give the same bits") {
    const std::vector<double> times = irregular(30, 4, 0.1, 9);
    Film first, second;
    for (const double time : times) {
        first.add(time, 0.1);
        second.add(time, 0.1);
        if (time > 2) second.predict(time + 0.08);  // asking changes nothing
    }
    first.predict(times.back() + 0.07);
    second.predict(times.back() + 0.07);
    CHECK(first.out == second.out);
    CHECK(first.out_error == second.out_error);
    CHECK(first.basis == second.basis);
}

TEST_CASE("row 204: a frame that is refused changes nothing") {
    Film film;
    for (int i = 0; i < 60; ++i) film.add(i / 30.0);
    film.predict(2);
    const std::vector<double> before = film.out;
    const double last = 59 / 30.0;
    CHECK(refusal([&] { film.predictor.add_frame(film.frame(last)); }, DEFREC_ERROR_ARGUMENT)
              .find("not after that of the frame before") != std::string::npos);
    film.xyz[3 * 6 + 1] = kNaN;
    CHECK(refusal([&] { film.predictor.add_frame(film.frame(2)); }, DEFREC_ERROR_ARGUMENT)
              .find("frame.xyz of point 6 has nan") != std::string::npos);
    film.xyz[3 * 6 + 1] = 0;
    film.error[3] = -1;
    CHECK(refusal([&] { film.predictor.add_frame(film.frame(2)); }, DEFREC_ERROR_ARGUMENT)
              .find("frame.expected_error_mm of point 3 is -1") != std::string::npos);
    film.error[3] = 0;
    film.status[2] = 3;
    CHECK(refusal([&] { film.predictor.add_frame(film.frame(2)); }, DEFREC_ERROR_ARGUMENT)
              .find("frame.status of point 2 is 3") != std::string::npos);
    film.predict(2);
    CHECK(film.out == before);
}

TEST_CASE("row 206: times of display that are refused") {
    Film film(3);
    CHECK(refusal([&] { film.predict(0); }, DEFREC_ERROR_STATE).find("no frame yet") !=
          std::string::npos);
    film.add(1);
    CHECK(refusal([&] { film.predict(0.999); }, DEFREC_ERROR_ARGUMENT)
              .find("before the last frame") != std::string::npos);
    film.predict(1.1);
    CHECK(refusal([&] { film.predict(1.101); }, DEFREC_ERROR_ARGUMENT).find("101 ms after") !=
          std::string::npos);
}

TEST_CASE("times at both ends of the clock") {
    Film film(2);
    FollowedPoints frame = film.frame(0);
    frame.time_ns = std::numeric_limits<int64_t>::min();
    film.predictor.add_frame(frame);
    frame.time_ns = std::numeric_limits<int64_t>::max() - 33'000'000;
    film.predictor.add_frame(frame);
    frame.time_ns = std::numeric_limits<int64_t>::max();
    film.predictor.add_frame(frame);
    double xyz[6];
    film.predictor.predict(std::numeric_limits<int64_t>::max(), {xyz});
    CHECK(xyz[2] == film.xyz[2]);
    CHECK(refusal([&] { film.predictor.predict(std::numeric_limits<int64_t>::min(), {xyz}); },
                  DEFREC_ERROR_ARGUMENT)
              .find("before the last frame") != std::string::npos);
}
