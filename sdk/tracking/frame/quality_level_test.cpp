// Which quality level is chosen, from times that are made up.
#include "sdk/tracking/frame/quality_level.hpp"

#include <doctest/doctest.h>

#include "include/defrec_c.h"

using namespace defrec;
using Time = QualityLevelTimes::Time;

namespace {

// Frames of a device on which each quality level takes so long, in seconds; how many were late.
struct Device {
    std::array<double, kQualityLevels> takes;
    QualityLevelTimes times;
    int late = 0;
    QualityLevel frame(double deadline) {
        const QualityLevel quality_level = times.choose(Time(deadline));
        const double took = takes[static_cast<size_t>(quality_level)];
        times.add(quality_level, Time(took));
        late += took > deadline;
        return quality_level;
    }
};

}  // namespace

TEST_CASE("without a known time all is tried, without any time left the least") {
    const QualityLevelTimes times;
    CHECK(times.choose(Time(1e-9)) == QualityLevel::kFull);
    CHECK(times.choose(Time(0)) == QualityLevel::kUnchecked);
    CHECK(times.choose(Time(-1)) == QualityLevel::kUnchecked);
}

TEST_CASE("what does not fit is left out, in order, and frames are late only when it is tried") {
    Device device{{0.020, 0.012, 0.010}, {}};
    CHECK(device.frame(1) == QualityLevel::kFull);
    CHECK(device.frame(0.019) == QualityLevel::kCoarse);
    CHECK(device.frame(0.013) == QualityLevel::kUnchecked);
    CHECK(device.late == 0);
    CHECK(device.frame(0.005) == QualityLevel::kUnchecked);
    CHECK(device.late == 1);
    for (int i = 0; i < 300; ++i) device.frame(0.016);
    CHECK(device.late <= 300 / 25);
    CHECK(device.frame(1) == QualityLevel::kFull);
}

TEST_CASE("one slow frame is forgotten, and a device that becomes slower or faster is followed") {
    Device device{{0.010, 0.006, 0.005}, {}};
    for (int i = 0; i < 10; ++i) CHECK(device.frame(0.030) == QualityLevel::kFull);
    device.takes = {1, 0.006, 0.005};
    device.frame(0.030);
    device.takes = {0.010, 0.006, 0.005};
    int frames = 0;
    while (device.frame(0.030) != QualityLevel::kFull && frames < 2000) ++frames;
    CHECK(frames < 600);
    for (int i = 0; i < 50; ++i) device.frame(0.030);
    CHECK(device.frame(0.030) == QualityLevel::kFull);

    device.takes = {0.040, 0.020, 0.018};
    for (int i = 0; i < 20; ++i) device.frame(0.030);
    CHECK(device.frame(0.030) == QualityLevel::kCoarse);
    device.takes = {0.010, 0.006, 0.005};
    for (int i = 0; i < 20; ++i) device.frame(0.030);
    CHECK(device.frame(0.030) == QualityLevel::kFull);
}

TEST_CASE("reasons name what was left out") {
    CHECK(reasons_of(QualityLevel::kFull) == 0);
    CHECK(reasons_of(QualityLevel::kCoarse) == DEFREC_REASON_COARSE);
    CHECK(reasons_of(QualityLevel::kUnchecked) == (DEFREC_REASON_COARSE | DEFREC_REASON_UNCHECKED));
}
