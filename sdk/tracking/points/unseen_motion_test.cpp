// Tissue that has left the image, or is hidden in it, is placed by what frames that showed it
// taught.
#include "sdk/tracking/points/unseen_motion.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <numbers>
#include <optional>
#include <utility>

#include "backends/shared/motion.hpp"

namespace {

using namespace defrec;
using Eigen::Vector3d;

constexpr int kColumns = 41, kRows = 31, kNodeStep = 5;
constexpr double kSpacing = 8, kFocal = 320, kDepth = 80;  // px, px, mm
constexpr double kStepMm = kSpacing * kDepth / kFocal;     // between vertices

// A plane that fills the view, with a control point at each fifth vertex along both axes.
// is_parted: by a cut along its middle.
TemplateData plane(double aside_mm = 0, bool is_parted = false) {
    TemplateData data;
    if (is_parted) data.node_grid.cuts.push_back({0, {{0, 120}, {320, 120}}});
    data.width = 320;
    data.height = 240;
    data.camera = {kFocal, kFocal, 160, 120, 5, 0};
    data.grid.columns = kColumns;
    data.grid.rows = kRows;
    data.grid.spacing = kSpacing;
    data.grid.disparity.assign(size_t{kColumns} * kRows, static_cast<float>(kFocal * 5 / kDepth));
    data.grid.support.assign(size_t{kColumns} * kRows, 0);
    constexpr int kNodeColumns = (kColumns - 1) / kNodeStep + 1,
                  kNodeRows = (kRows - 1) / kNodeStep + 1;
    const auto add_place = [aside_mm](int x, int y, auto&& add) {
        add((x * kSpacing - 160) * kDepth / kFocal + aside_mm);
        add((y * kSpacing - 120) * kDepth / kFocal);
        add(kDepth);
    };
    for (int y = 0; y < kNodeRows; ++y)
        for (int x = 0; x < kNodeColumns; ++x)
            add_place(x * kNodeStep, y * kNodeStep,
                      [&](double value) { data.nodes.push_back(static_cast<float>(value)); });
    for (int y = 0; y < kRows; ++y)
        for (int x = 0; x < kColumns; ++x) {
            data.grid.vertex.push_back(static_cast<int32_t>(data.vertices.size()));
            defrec_surface_point point{};
            int axis = 0;
            add_place(x, y,
                      [&](double value) { point.position[axis++] = static_cast<float>(value); });
            point.normal[2] = -1;
            const int left = std::min(x / kNodeStep, kNodeColumns - 2),
                      top = std::min(y / kNodeStep, kNodeRows - 2);
            const float u = static_cast<float>(x - left * kNodeStep) / kNodeStep,
                        v = static_cast<float>(y - top * kNodeStep) / kNodeStep;
            for (int k = 0; k < 4; ++k) {
                point.node[k] = (top + k / 2) * kNodeColumns + left + k % 2;
                point.weight[k] = (k % 2 != 0 ? u : 1 - u) * (k / 2 != 0 ? v : 1 - v);
            }
            data.vertices.push_back(point);
            data.vertex_support.push_back(0);
        }
    return data;
}

using Place = std::function<Vector3d(const Vector3d&)>;

// The parts of the plane that a frame does not show.
struct NotSeen {
    double right_mm = 1e9;                     // beyond is out of the image
    Vector3d outside_off = Vector3d(6, 0, 0);  // mm, by which lm errs there
    float outside_mm = 7;                      // as it expects
    double radius_mm = 0;                      // about the middle it is hidden
    uint8_t evidence = 0;                      // of what is hidden
    Vector3d hidden_off = Vector3d(0, 3, 0);   // mm, by which lm errs there
    float common_mm2 = 0;                      // of all squared errors
    // What is hidden is covered at the depth of the surface, and known to be.
    bool is_covered = false;
};

// Frames of the plane as a tracker has them.
class Frames {
  public:
    Frames() : surface_(std::in_place, plane()), unseen_(*surface_) {
        pieces_.resize(1);
        pieces_[0].state = DEFREC_TRACKING;
    }
    const Template& surface() const { return *surface_; }
    size_t count() const { return surface_->data().vertices.size(); }
    Vector3d rest(size_t vertex) const {
        return Eigen::Map<const Eigen::Vector3f>(surface_->data().vertices[vertex].position)
            .cast<double>();
    }
    bool is_outside(size_t vertex) const { return samples_[vertex].observation == DEFREC_OUTSIDE; }
    void forget() { unseen_ = UnseenMotion(*surface_); }
    void part() {
        surface_.emplace(plane(0, true));
        unseen_ = UnseenMotion(*surface_, unseen_);
    }
    // To a plane that reaches farther on one side.
    void change_template(double aside_mm) {
        surface_.emplace(plane(aside_mm));
        unseen_ = UnseenMotion(*surface_, unseen_);
    }
    void lose() { pieces_[0].state = DEFREC_LOST; }
    void add_lost() { unseen_.add_lost_frame(); }

    bool add(const Place& place, double right_mm) {
        return add(place, NotSeen{.right_mm = right_mm});
    }
    bool add(const Place& place, const NotSeen& not_seen = {}) {
        samples_.assign(count(), {});
        confidence_.status.assign(count(), DEFREC_POINT_OBSERVED);
        confidence_.evidence.assign(count(), DEFREC_EVIDENCE_DEPTH | DEFREC_EVIDENCE_PHOTOMETRIC);
        confidence_.expected_error.assign(count(), 0.05f);
        confidence_.covariance.assign(6 * count(), 0);
        confidence_.common_mm2.assign(count(), not_seen.common_mm2);
        confidence_.covered.assign(not_seen.is_covered ? count() : 0, 0);
        vertices_.clear();
        normals_.assign(3 * count(), 0);
        const auto off = [&](const Vector3d& at) -> Vector3d {
            if (at.x() > not_seen.right_mm) return not_seen.outside_off;
            return is_hidden(at, not_seen.radius_mm) ? not_seen.hidden_off : Vector3d(0, 0, 0);
        };
        for (size_t i = 0; i < count(); ++i) {
            const Vector3d now = place(rest(i)) + off(rest(i));
            if (rest(i).x() > not_seen.right_mm)
                give(i, DEFREC_OUTSIDE, DEFREC_POINT_UNKNOWN, 0, not_seen.outside_mm);
            else if (is_hidden(rest(i), not_seen.radius_mm))
                give(i, not_seen.is_covered ? DEFREC_OBSERVED : DEFREC_OCCLUDED,
                     DEFREC_POINT_EXTRAPOLATED, not_seen.evidence, 4);
            if (not_seen.is_covered)
                confidence_.covered[i] = is_hidden(rest(i), not_seen.radius_mm);
            for (int axis = 0; axis < 3; ++axis) {
                samples_[i].position[axis] = static_cast<float>(now[axis]);
                vertices_.push_back(samples_[i].position[axis]);
                confidence_.covariance[6 * i + std::array{0u, 3u, 5u}[static_cast<size_t>(axis)]] =
                    confidence_.expected_error[i] * confidence_.expected_error[i] / 3;
            }
        }
        motions_.clear();
        for (size_t node = 0; node < surface_->data().nodes.size(); node += 3) {
            const Vector3d at =
                Eigen::Map<const Eigen::Vector3f>(&surface_->data().nodes[node]).cast<double>();
            const Vector3d step = place(at) + off(at) - at;
            motions_.push_back(
                from_rigid(DualQuaternion<double>::identity().real, {step.x(), step.y(), step.z()})
                    .store());
        }
        given_ = motions_;
        int solved = 0;
        const bool is_told = unseen_.add_frame(
            *surface_, samples_, pieces_,
            {motions_, vertices_, normals_, confidence_, [&] { ++solved; }, [](size_t) {}},
            nullptr);
        CHECK(solved == (is_told ? 1 : 0));
        unseen_.learn();
        return is_told;
    }
    static bool is_hidden(const Vector3d& at, double radius_mm) {
        return std::hypot(at.x(), at.y()) < radius_mm;
    }
    Vector3d now(size_t vertex) const {
        return Eigen::Map<const Eigen::Vector3f>(&vertices_[3 * vertex]).cast<double>();
    }
    double expected_mm(size_t vertex) const {
        return static_cast<double>(confidence_.expected_error[vertex]);
    }
    // Vertices some mm beyond the border of the image.
    template <class Function>
    void for_outside(double right_mm, const Function& function) const {
        for (size_t i = 0; i < count(); ++i)
            if (rest(i).x() > right_mm + 2 * kNodeStep * kStepMm) function(i);
    }
    double worst(const Place& place, double right_mm) const {
        double worst = 0;
        for_outside(right_mm,
                    [&](size_t i) { worst = std::max(worst, (now(i) - place(rest(i))).norm()); });
        return worst;
    }
    double worst_hidden(const Place& place, double radius_mm) const {
        double worst = 0;
        for (size_t i = 0; i < count(); ++i)
            if (is_hidden(rest(i), radius_mm - 2 * kNodeStep * kStepMm))
                worst = std::max(worst, (now(i) - place(rest(i))).norm());
        return worst;
    }
    const std::vector<defrec_motion>& motions() const { return motions_; }
    // Before they were changed.
    const std::vector<defrec_motion>& given_motions() const { return given_; }

  private:
    void give(size_t i, uint32_t observation, uint8_t status, uint8_t evidence, float expected_mm) {
        samples_[i].observation = observation;
        confidence_.status[i] = status;
        confidence_.evidence[i] = evidence;
        confidence_.expected_error[i] = expected_mm;
    }

    std::optional<Template> surface_;
    UnseenMotion unseen_;
    std::vector<defrec_piece> pieces_;
    std::vector<defrec_surface_sample> samples_;
    VertexConfidence confidence_;
    std::vector<float> vertices_, normals_;
    std::vector<defrec_motion> motions_, given_;
};

Eigen::Isometry3d motion_at(double time) {
    return Eigen::Translation3d(3 * std::sin(0.3 * time), time * 0.2, -2 * std::cos(0.2 * time)) *
           Eigen::AngleAxisd(0.1 * std::sin(0.25 * time), Vector3d(1, 2, 0.5).normalized());
}

// Both sides breathe against each other: what the left does tells of the right.
Place breathing(double time) {
    return [time](const Vector3d& rest) -> Vector3d {
        const double wave = 1.5 * std::sin(0.7 * time) * std::sin(std::numbers::pi * rest.x() / 60);
        return motion_at(time) * (rest + Vector3d(0, 0, wave));
    };
}
Place rigid(double time) {
    return [time](const Vector3d& rest) -> Vector3d { return motion_at(time) * rest; };
}

constexpr double kRight = 0;  // half of the plane is out of the image

}  // namespace

TEST_CASE("tissue out of the image moves as a rigid body where all that is seen does") {
    Frames frames;
    CHECK_FALSE(frames.add(rigid(0)));
    CHECK(frames.add(rigid(5), kRight));
    CHECK(frames.worst(rigid(5), kRight) < 0.02);
    for (int i = 6; i < 20; ++i) CHECK(frames.add(rigid(i), kRight));
    CHECK(frames.worst(rigid(19), kRight) < 0.02);
    frames.for_outside(kRight, [&](size_t i) { CHECK(frames.expected_mm(i) < 2); });
}

TEST_CASE("what is in the image stays as it is, to the bit, with what moves it") {
    Frames frames;
    REQUIRE(frames.add(breathing(3), kRight));
    for (size_t i = 0; i < frames.count(); ++i) {
        if (frames.is_outside(i)) continue;
        CHECK(frames.now(i) == breathing(3)(frames.rest(i)).cast<float>().cast<double>());
        CHECK(frames.expected_mm(i) == doctest::Approx(0.05));
        const defrec_surface_point& vertex = frames.surface().data().vertices[i];
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
            if (vertex.weight[k] > 0) {
                const auto node = static_cast<size_t>(vertex.node[k]);
                CHECK(std::memcmp(&frames.motions()[node], &frames.given_motions()[node],
                                  sizeof(defrec_motion)) == 0);
            }
    }
}

TEST_CASE("points of the template move as the vertices with the control points out of the image") {
    Frames frames;
    REQUIRE(frames.add(breathing(3), kRight));
    frames.for_outside(kRight, [&](size_t i) {
        const defrec_surface_point& vertex = frames.surface().data().vertices[i];
        const auto motion = blend<double>(frames.motions().data(), vertex.node, vertex.weight);
        const Vec3<double> now = apply(motion, load3<double>(vertex.position));
        CHECK((Vector3d(now.x, now.y, now.z) - frames.now(i)).norm() < 1e-4);
    });
}

TEST_CASE("what moved together while it was seen is known to do so when a part is not") {
    Frames frames;
    for (int i = 0; i < 40; ++i) CHECK_FALSE(frames.add(breathing(i)));
    double learnt = 0, unlearnt = 0;
    for (int i = 40; i < 60; ++i) {
        REQUIRE(frames.add(breathing(i), kRight));
        learnt = std::max(learnt, frames.worst(breathing(i), kRight));
    }
    for (int i = 40; i < 60; ++i) {
        frames.forget();
        REQUIRE(frames.add(breathing(i), kRight));
        unlearnt = std::max(unlearnt, frames.worst(breathing(i), kRight));
    }
    CAPTURE(unlearnt);
    CHECK(learnt < 0.25);
    CHECK(unlearnt > 2 * learnt);
}

TEST_CASE("what was learnt stays when the template changes") {
    Frames frames;
    for (int i = 0; i < 40; ++i) frames.add(breathing(i));
    frames.change_template(7);
    REQUIRE(frames.add(breathing(42), kRight));
    const double learnt = frames.worst(breathing(42), kRight);
    frames.forget();
    REQUIRE(frames.add(breathing(42), kRight));
    CHECK(learnt < 0.75 * frames.worst(breathing(42), kRight));
}

TEST_CASE("expected errors out of the image hold, before anything is learnt and after") {
    Frames frames;
    size_t within_1 = 0, within_3 = 0, count = 0;
    double largest = 0;
    const auto compare = [&](int i) {
        frames.for_outside(kRight, [&](size_t vertex) {
            const double error = (frames.now(vertex) - breathing(i)(frames.rest(vertex))).norm();
            within_1 += error < frames.expected_mm(vertex);
            largest = std::max(largest, frames.expected_mm(vertex));
            within_3 += error < 3 * frames.expected_mm(vertex);
            ++count;
        });
    };
    for (int i = 0; i < 40; ++i) {
        if (i % 4 != 3) {
            frames.add(breathing(i));
            continue;
        }
        REQUIRE(frames.add(breathing(i), kRight));
        compare(i);
    }
    CHECK(within_1 > 0.55 * static_cast<double>(count));
    CHECK(largest < 2);
    CHECK(within_3 > 0.985 * static_cast<double>(count));
}

TEST_CASE("an error that all that is seen shares is whole out of the image, beside a cut too") {
    for (const bool is_parted : {false, true}) {
        CAPTURE(is_parted);
        Frames sound, late;
        for (int i = 0; i < 10; ++i)
            for (Frames* frames : {&sound, &late}) frames->add(breathing(i));
        if (is_parted)
            for (Frames* frames : {&sound, &late}) frames->part();
        constexpr float kShared = 0.36f;
        REQUIRE(sound.add(breathing(10), {.right_mm = kRight}));
        REQUIRE(late.add(breathing(10), {.right_mm = kRight, .common_mm2 = kShared}));
        sound.for_outside(kRight, [&](size_t i) {
            CHECK(std::pow(late.expected_mm(i), 2) - std::pow(sound.expected_mm(i), 2) ==
                  doctest::Approx(kShared).epsilon(is_parted ? 1e-2 : 1e-3));
        });
    }
}

TEST_CASE("of a surface that is lost, or of which a strip is seen, nothing is told") {
    Frames frames;
    CHECK_FALSE(frames.add(rigid(1), -38));
    CHECK(frames.worst(rigid(1), -38) > 5);
    CHECK(frames.add(rigid(1), kRight));
    frames.lose();
    CHECK_FALSE(frames.add(rigid(2), kRight));
    CHECK(frames.worst(rigid(2), kRight) > 5);
}

TEST_CASE("tissue that is not seen ages while the surface is lost") {
    Frames once, lost, unseen;
    for (Frames* frames : {&once, &lost, &unseen})
        for (int i = 0; i < 10; ++i) frames->add(breathing(i));
    constexpr int kFrames = 15;
    for (int i = 1; i < kFrames; ++i) {
        lost.add_lost();
        REQUIRE(unseen.add(breathing(9), kRight));
    }
    for (Frames* frames : {&once, &lost, &unseen}) REQUIRE(frames->add(breathing(9), kRight));
    size_t count = 0;
    lost.for_outside(kRight + 10, [&](size_t i) {
        ++count;
        CHECK(lost.expected_mm(i) > 1.2 * once.expected_mm(i));
        CHECK(lost.expected_mm(i) == doctest::Approx(unseen.expected_mm(i)).epsilon(0.1));
    });
    CHECK(count > 0);
}

TEST_CASE("vertices that are called observed and are not do not carry the rest along") {
    const Place slipped = [](const Vector3d& rest) -> Vector3d {
        const Vector3d slip = rest.x() > -8 && rest.y() < 0 ? Vector3d(0, 5, 3) : Vector3d(0, 0, 0);
        return rigid(4)(rest) + slip;
    };
    Frames frames;
    for (int i = 0; i < 10; ++i) frames.add(rigid(0));
    REQUIRE(frames.add(slipped, kRight));
    CHECK(frames.worst(rigid(4), kRight) < 3);
}

TEST_CASE("beside a cut whose sides slide tissue stays where lm continues its own side") {
    const Place slid = [](const Vector3d& rest) -> Vector3d {
        return rigid(4)(rest) + Vector3d(rest.y() > 0 ? 8 : 0, 0, 0);
    };
    const NotSeen outside{.right_mm = kRight, .outside_off = Vector3d(0, 0, 0), .outside_mm = 1};
    const auto worst = [&](bool is_parted) {
        Frames frames;
        for (int i = 0; i < 10; ++i) frames.add(rigid(0));
        if (is_parted) frames.part();
        REQUIRE(frames.add(slid, outside));
        double largest = 0;
        frames.for_outside(kRight, [&](size_t i) {
            if (is_parted) CHECK(frames.expected_mm(i) == doctest::Approx(1).epsilon(0.1));
            // Vertices between control points of both sides move with neither.
            if (std::abs(frames.rest(i).y()) > kNodeStep * kStepMm)
                largest = std::max(largest, (frames.now(i) - slid(frames.rest(i))).norm());
        });
        return largest;
    };
    CHECK(worst(true) < 0.5);
    CHECK(worst(false) > 3);
}

TEST_CASE("beside a cut whose sides move as one tissue is placed as without it") {
    Frames whole, parted;
    for (int i = 0; i < 40; ++i)
        for (Frames* frames : {&whole, &parted}) frames->add(breathing(i));
    parted.part();
    REQUIRE(whole.add(breathing(41), kRight));
    REQUIRE(parted.add(breathing(41), kRight));
    CHECK(parted.worst(breathing(41), kRight) < whole.worst(breathing(41), kRight) + 0.3);
}

namespace {

constexpr double kRadius = 24;

}  // namespace

TEST_CASE("hidden tissue moves as it did with what is seen round it") {
    Frames frames;
    for (int i = 0; i < 40; ++i) CHECK_FALSE(frames.add(breathing(i)));
    for (int i = 40; i < 60; ++i) {
        REQUIRE(frames.add(breathing(i), {.radius_mm = kRadius}));
        CHECK(frames.worst_hidden(breathing(i), kRadius) < 0.6);
    }
}

TEST_CASE("what is drawn to a cover at the surface's depth is placed up to the cover's border") {
    const NotSeen hidden{.radius_mm = 13, .hidden_off = Vector3d(0, 0, -1.5)};
    NotSeen covered = hidden;
    covered.is_covered = true;
    const auto mean_error = [](const Frames& frames, const Place& place) {
        double sum = 0, count = 0;
        for (size_t i = 0; i < frames.count(); ++i) {
            if (!Frames::is_hidden(frames.rest(i), 13)) continue;
            sum += (frames.now(i) - place(frames.rest(i))).norm();
            ++count;
        }
        return sum / count;
    };
    Frames with_colour, without;
    for (int i = 0; i < 40; ++i)
        for (Frames* frames : {&with_colour, &without}) CHECK_FALSE(frames->add(breathing(i)));
    for (int i = 40; i < 50; ++i) {
        REQUIRE(with_colour.add(breathing(i), covered));
        without.add(breathing(i), hidden);
        CHECK(mean_error(with_colour, breathing(i)) < 0.5);
        CHECK(mean_error(without, breathing(i)) > 0.9);
    }
}

TEST_CASE("hidden tissue that moves by itself keeps an error that covers it") {
    const auto dragged = [](double time) -> Place {
        return [time](const Vector3d& rest) -> Vector3d {
            return breathing(time)(rest) + Vector3d(0.1 * (time - 40), 0, 0) *
                                               std::exp(-rest.head<2>().squaredNorm() / 200);
        };
    };
    Frames frames;
    for (int i = 0; i < 40; ++i) frames.add(breathing(i));
    for (int i = 40; i < 60; ++i) {
        REQUIRE(frames.add(dragged(i), {.radius_mm = kRadius, .hidden_off = Vector3d(0, 0, 0)}));
        for (size_t v = 0; v < frames.count(); ++v)
            if (Frames::is_hidden(frames.rest(v), kRadius))
                CHECK((frames.now(v) - dragged(i)(frames.rest(v))).norm() <
                      3 * frames.expected_mm(v));
    }
}

TEST_CASE("tissue that is seen stays as it is, and so does what depth shows") {
    for (const int kind : {0, int{DEFREC_EVIDENCE_DEPTH}, int{DEFREC_EVIDENCE_PHOTOMETRIC}}) {
        const auto evidence = static_cast<uint8_t>(kind);
        CAPTURE(evidence);
        Frames frames;
        for (int i = 0; i < 10; ++i) frames.add(breathing(i));
        CHECK(frames.add(breathing(10), {.radius_mm = kRadius, .evidence = evidence}) ==
              (evidence == 0));
        const double reach = evidence == 0 ? kRadius + 0.01 : 0;
        for (size_t i = 0; i < frames.count(); ++i)
            if (!Frames::is_hidden(frames.rest(i), reach))
                CHECK(frames.expected_mm(i) ==
                      doctest::Approx(Frames::is_hidden(frames.rest(i), kRadius) ? 4 : 0.05));
    }
}
