// Templates as files: what a file may hold, whoever wrote it.
#include <doctest/doctest.h>
#include <pthread.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <limits>
#include <thread>

#include "sdk/template/decisions.hpp"
#include "sdk/template/template.hpp"
#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_files.hpp"

namespace {

using defrec::TemplateData;

// A square of four vertices that one control point moves; no triangles, landmarks and patches.
TemplateData square() {
    TemplateData data;
    data.width = 64;
    data.height = 48;
    data.camera = {100, 100, 32, 24, 5, 0};
    data.grid = {2, 2, 40, {10, 10, 10, 10}, {0, 0, 0, 0}, {0, 1, 2, 3}, {}};
    data.node_grid = {2, 2, 40, 40, {0, 0, 0, 0}, {}};
    data.node_spacing_mm = 20;
    for (int i = 0; i < 4; ++i) {
        defrec_surface_point point{};
        point.position[0] = static_cast<float>(20 * (i % 2));
        point.position[1] = static_cast<float>(20 * (i / 2));
        point.position[2] = 50;
        point.normal[2] = -1;
        point.weight[0] = 1;
        data.vertices.push_back(point);
    }
    data.vertex_support.assign(4, 0);
    data.nodes = {10, 10, 50};
    data.check_of_vertex.assign(4, -1);
    data.image.assign(64 * 48, 128);
    return data;
}

// Its lower two vertices are of another piece, which another control point moves.
TemplateData two_pieces() {
    TemplateData data = square();
    data.nodes.insert(data.nodes.end(), {10, 20, 50});
    data.node_piece = {0, 1};
    data.node_grid.node = {0, 0, -1, -1, -1, -1, 1, 1};
    data.grid.piece = {0, 0, 1, 1};
    for (size_t i = 2; i < 4; ++i) std::fill_n(data.vertices[i].node, DEFREC_BLEND_NODES, 1);
    return data;
}

// Saved and loaded; nullptr: refused, as defrec_last_error() says.
defrec_template reload(const TemplateData& data) {
    const defrec::test::TemporaryFolder folder;
    const std::string path = folder.path() / "template";
    defrec::Template(data).save(path.c_str());
    const defrec::test::TestContext context;
    defrec_template loaded = nullptr;
    const defrec_status status = defrec_template_load(context.get(), path.c_str(), &loaded);
    CHECK(status == (loaded != nullptr ? DEFREC_OK : DEFREC_ERROR_IO));
    return loaded;
}

}  // namespace

TEST_CASE("a template without triangles, landmarks and patches is read as it was written") {
    defrec_template loaded = reload(square());
    REQUIRE(loaded != nullptr);
    defrec_template_info info;
    DEFREC_INIT(&info);
    REQUIRE(defrec_template_get(loaded, &info) == DEFREC_OK);
    CHECK(info.vertex_count == 4);
    CHECK(info.triangle_count + info.edge_count + info.landmark_count + info.patch_count == 0);
    defrec_template_release(loaded);
}

TEST_CASE("numbers of a file that are not finite are refused") {
    struct Place {
        const char* refusal;
        std::function<void(TemplateData&, double)> set;
    };
    const Place places[] = {
        {"camera", [](TemplateData& d, double v) { d.camera.fx = v; }},
        {"camera", [](TemplateData& d, double v) { d.camera.fy = v; }},
        {"camera", [](TemplateData& d, double v) { d.camera.cx = v; }},
        {"camera", [](TemplateData& d, double v) { d.camera.cy = v; }},
        {"camera", [](TemplateData& d, double v) { d.camera.baseline_mm = v; }},
        {"surface grid", [](TemplateData& d, double v) { d.grid.spacing = v; }},
        {"surface grid",
         [](TemplateData& d, double v) { d.grid.disparity[3] = static_cast<float>(v); }},
        {"surface grid",
         [](TemplateData& d, double v) { d.grid.support[3] = static_cast<float>(v); }},
        {"grid of control points", [](TemplateData& d, double v) { d.node_grid.spacing_u = v; }},
        {"grid of control points", [](TemplateData& d, double v) { d.node_grid.spacing_v = v; }},
        {"spacing", [](TemplateData& d, double v) { d.node_spacing_mm = v; }},
        {"control points", [](TemplateData& d, double v) { d.nodes[2] = static_cast<float>(v); }},
        {"surface", [](TemplateData& d, double v) { d.vertex_support[3] = static_cast<float>(v); }},
        {"surface point",
         [](TemplateData& d, double v) { d.vertices[3].position[2] = static_cast<float>(v); }},
        {"connection",
         [](TemplateData& d, double v) {
             d.nodes.insert(d.nodes.end(), {10, 30, 50});
             d.edges = {{0, 1, static_cast<float>(v)}};
         }},
        {"landmark",
         [](TemplateData& d, double v) {
             d.landmarks.resize(1);
             d.landmarks[0].position[0] = static_cast<float>(v);
             d.landmark_points = {d.vertices[0]};
         }},
    };
    for (const Place& place : places)
        for (const double value :
             {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
            TemplateData data = square();
            place.set(data, value);
            CAPTURE(&place - places);
            CAPTURE(value);
            CHECK(reload(data) == nullptr);
            CHECK(std::string(defrec_last_error()).find(place.refusal) != std::string::npos);
        }
}

namespace {

// The square with another beside it that joined: two vertices, a control point, an atlas image.
TemplateData grown_square() {
    TemplateData data = square();
    defrec::SurfacePatch part;
    part.columns = 2;
    part.rows = 2;
    part.step_mm = 20;
    part.min_disparity = part.max_disparity = 10;
    part.vertex = {1, 4, 3, 5};
    part.before = data.counts();
    for (int i = 0; i < 2; ++i) {
        data.vertices.push_back(data.vertices[static_cast<size_t>(1 + 2 * i)]);
        data.vertices.back().position[0] = 40;
        data.vertices.back().node[0] = 1;
    }
    data.vertex_support.assign(6, 0);
    data.nodes.insert(data.nodes.end(), {30, 10, 50});
    data.edges = {{0, 1, 1}};
    data.triangles = {1, 3, 4, 4, 3, 5};
    defrec_patch patch{};
    patch.view = 1;
    patch.weight[0] = 1;
    patch.tangent_u[0] = patch.tangent_v[1] = 1;
    data.patches = {patch};
    data.checks = {patch};
    data.check_of_vertex = {-1, 0, -1, -1, 0, -1};
    data.image.resize(2 * 64 * 48, 7);
    data.parts = {part};
    data.atlas_end = {16, 0, 24};
    return data;
}

}  // namespace

TEST_CASE("a template that has grown, has pieces or was cut is read as it was written") {
    const auto cut = [](TemplateData data) {
        data.node_grid.cuts = {{0, {{5, 6}, {7, 8.5f}}}, {0, {{-3, 6}, {7, 8}, {9, 9}}}};
        return data;
    };
    // Tissue that recedes behind what views that converge see at a raw disparity of 0.
    const auto converging = [](TemplateData data) {
        data.camera.disparity_offset_px = 12.5;
        return data;
    };
    const TemplateData templates[] = {square(),
                                      grown_square(),
                                      two_pieces(),
                                      cut(square()),
                                      cut(grown_square()),
                                      cut(two_pieces()),
                                      converging(square()),
                                      converging(grown_square())};
    for (const TemplateData& data : templates) {
        CAPTURE(&data - templates);
        const defrec::test::TemporaryFolder folder;
        const std::string path = folder.path() / "template", again = folder.path() / "again";
        defrec::Template(data).save(path.c_str());
        const defrec::test::TestContext context;
        defrec_template loaded = nullptr;
        REQUIRE(defrec_template_load(context.get(), path.c_str(), &loaded) == DEFREC_OK);
        REQUIRE(defrec_template_save(loaded, again.c_str()) == DEFREC_OK);
        defrec_template_release(loaded);
        CHECK(defrec::test::read_file(path) == defrec::test::read_file(again));
    }
}

TEST_CASE("a file of another layout is refused by its number") {
    const defrec::test::TemporaryFolder folder;
    const std::string path = folder.path() / "template";
    defrec::Template(square()).save(path.c_str());
    auto bytes = defrec::test::read_file(path);
    const defrec::test::TestContext context;
    for (const unsigned char layout : {0, 1, 3, 255}) {
        bytes[8] = layout;
        defrec::test::write_file(path, bytes);
        CAPTURE(layout);
        defrec_template loaded = nullptr;
        CHECK(defrec_template_load(context.get(), path.c_str(), &loaded) == DEFREC_ERROR_VERSION);
        CHECK(loaded == nullptr);
        CHECK(defrec::test::contains(defrec_last_error(), "has layout " + std::to_string(layout) +
                                                              ", this library reads 2"));
    }
}

TEST_CASE("pieces that do not fit their template are refused") {
    const std::function<void(TemplateData&)> faults[] = {
        [](TemplateData& d) { d.node_piece.push_back(1); },
        [](TemplateData& d) { d.node_piece[1] = defrec::decisions::TemplatePieces::kMaxPieces; },
        [](TemplateData& d) { d.node_piece[1] = 0; },
        [](TemplateData& d) { d.node_grid.node.push_back(0); },
        [](TemplateData& d) { d.node_grid.node.resize(d.node_grid.cells()); },
        [](TemplateData& d) { d.node_grid.node.resize(3 * d.node_grid.cells(), -1); },
        [](TemplateData& d) { std::swap(d.node_grid.node[0], d.node_grid.node[6]); },
    };
    for (const auto& spoil : faults) {
        TemplateData data = two_pieces();
        spoil(data);
        CAPTURE(&spoil - faults);
        CHECK(reload(data) == nullptr);
    }
}

TEST_CASE("a piece without a grid of control points has no slope, and moves nothing") {
    const TemplateData data = two_pieces();
    defrec::BlendWeights weights;
    for (const double v : {3.0, 45.0}) {
        CHECK_FALSE(defrec::grid_blend_weights(data.node_grid, 2, 20, v, weights));
        const defrec_patch_slope slope = defrec::grid_slope(data.node_grid, 2, 20, v);
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
            CHECK((slope.weight_u[k] == 0 && slope.weight_v[k] == 0));
    }
}

TEST_CASE("cuts that are no lines are refused") {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<std::array<float, 2>> faults[] = {
        {}, {{5, 6}}, {{5, 6}, {nan, 6}}, {{5, 6}, {5, 1e9f}}, {{5, -1e9f}, {5, 6}}};
    for (const auto& pixels : faults) {
        TemplateData data = square();
        data.node_grid.cuts = {{0, {{5, 6}, {7, 8}}}, {0, pixels}};
        CAPTURE(pixels.size());
        CHECK(reload(data) == nullptr);
    }
}

TEST_CASE("parts that do not fit their template are refused") {
    struct Place {
        const char* refusal;
        std::function<void(TemplateData&)> spoil;
    };
    const Place places[] = {
        {"image", [](TemplateData& d) { d.image.pop_back(); }},
        {"patch", [](TemplateData& d) { d.patches[0].view = 2; }},
        {"part's counts", [](TemplateData& d) { d.parts[0].before.vertices = 7; }},
        {"part's counts", [](TemplateData& d) { d.parts[0].before.nodes = 3; }},
        {"part's grid", [](TemplateData& d) { d.parts[0].columns = 3; }},
        {"part's grid", [](TemplateData& d) { d.parts[0].step_mm = 0; }},
        {"part's vertex", [](TemplateData& d) { d.parts[0].vertex[0] = 6; }},
        {"atlas", [](TemplateData& d) { d.atlas_end.x = 65; }},
        {"check", [](TemplateData& d) { d.check_of_vertex[4] = 1; }},
        {"check", [](TemplateData& d) { d.check_of_vertex.pop_back(); }},
        {"check", [](TemplateData& d) { d.checks[0].node[0] = 2; }},
    };
    for (const Place& place : places) {
        TemplateData data = grown_square();
        place.spoil(data);
        CAPTURE(&place - places);
        CHECK(reload(data) == nullptr);
        CHECK(std::string(defrec_last_error()).find(place.refusal) != std::string::npos);
    }
}

TEST_CASE("files of others beside a template are left alone, and none of its own") {
    const defrec::test::TemporaryFolder folder;
    const std::string path = folder.path() / "template";
    const std::vector<unsigned char> mine{'m', 'i', 'n', 'e'};
    const std::string others[] = {path + ".partial", path + ".0.partial"};
    for (const std::string& other : others) defrec::test::write_file(other, mine);
    defrec::Template(square()).save(path.c_str());
    for (const std::string& other : others) CHECK(defrec::test::read_file(other) == mine);
    const std::string pipe = folder.path() / "pipe";
    REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
    for (const std::string& place : {pipe, folder.path().string(), path + "/below"})
        CHECK_THROWS(defrec::Template(square()).save(place.c_str()));
    CHECK(std::filesystem::is_fifo(pipe));
    const std::filesystem::directory_iterator files(folder.path());
    CHECK(std::distance(begin(files), end(files)) == 4);
}

TEST_CASE("templates that are saved to one path at the same time are each whole") {
    const defrec::test::TemporaryFolder folder;
    const std::string path = folder.path() / "template";
    TemplateData small = square(), large = square();
    large.image.assign(size_t{large.width = 1024} * (large.height = 1024), 7);
    const defrec::Template templates[] = {defrec::Template(small), defrec::Template(large)};
    templates[0].save(path.c_str());
    std::atomic<int> saving = 2, failures = 0;
    const auto save = [&](const defrec::Template& surface) {
        for (int i = 0; i < 40; ++i) try {
                surface.save(path.c_str());
            } catch (const std::exception&) {
                ++failures;
            }
        --saving;
    };
    std::thread threads[] = {std::thread(save, std::cref(templates[0])),
                             std::thread(save, std::cref(templates[1]))};
    const defrec::test::TestContext context;
    while (saving > 0) {
        defrec_template loaded = nullptr;
        CHECK(defrec_template_load(context.get(), path.c_str(), &loaded) == DEFREC_OK);
        defrec_template_release(loaded);
    }
    for (std::thread& thread : threads) thread.join();
    CHECK(failures == 0);
}

TEST_CASE("a surface from an application's disparity may have more of it than the image is wide") {
    for (const float disparity : {64.5f, 2000.0f, 2501.0f}) {
        TemplateData data = square();
        data.disparity_sigma_px = 0.3f;
        data.grid.disparity[3] = disparity;
        CAPTURE(disparity);
        defrec_template loaded = reload(data);
        CHECK((loaded != nullptr) == (disparity < 2500));
        defrec_template_release(loaded);
    }
}

TEST_CASE(
    "row 92: a surface without disparity, with one behind the camera, or with one wider than the "
    "image is refused") {
    for (const float disparity : {0.f, -0.f, -10.f, 64.5f, 2.8e29f}) {
        TemplateData data = square();
        data.grid.disparity[3] = disparity;
        CAPTURE(disparity);
        CHECK(reload(data) == nullptr);
        CHECK(defrec::test::contains(defrec_last_error(), "disparity"));
        data.grid.vertex[3] = -1;  // where there is no surface it means nothing
        defrec_template loaded = reload(data);
        CHECK(loaded != nullptr);
        defrec_template_release(loaded);
    }
}

TEST_CASE("row 92: pixels that no number of the grid can hold are outside of the surface") {
    defrec_template loaded = reload(square());
    REQUIRE(loaded != nullptr);
    const double huge = std::numeric_limits<double>::max();
    const double uv[] = {huge, huge, -huge, 1, 1, std::numeric_limits<double>::quiet_NaN()};
    double xyz[9];
    uint8_t found[3];
    REQUIRE(defrec_template_lift(loaded, uv, 3, xyz, found) == DEFREC_OK);
    for (const uint8_t one : found) CHECK(one == 0);
    defrec_template_release(loaded);
}

TEST_CASE("row 94: what does not begin as a template is refused before it is read") {
    const defrec::test::TemporaryFolder folder;
    const std::string path = folder.path() / "sparse";
    defrec::test::write_file(path, std::string("no template"));
    std::filesystem::resize_file(path, uint64_t{1} << 30);  // without blocks on the disk
    // Less memory than the file has bytes.
    rlimit before{};
    REQUIRE(getrlimit(RLIMIT_DATA, &before) == 0);
    const defrec::test::TestContext context;
    rlimit little = before;
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // whose own tables count
    little.rlim_cur = rlim_t{512} << 20;
#endif
    REQUIRE(setrlimit(RLIMIT_DATA, &little) == 0);
    defrec_template loaded = nullptr;
    const defrec_status status = defrec_template_load(context.get(), path.c_str(), &loaded);
    REQUIRE(setrlimit(RLIMIT_DATA, &before) == 0);
    CHECK(status == DEFREC_ERROR_IO);
    CHECK(defrec::test::contains(defrec_last_error(), "does not begin as one"));
}

namespace {

bool is_pending(int signal) {
    sigset_t pending;
    sigpending(&pending);
    return sigismember(&pending, signal) == 1;
}

// In a process whose files must not grow, and whose SIGXFSZ is as it was when it started. Returns
// what is wrong, 0 if nothing.
int save_beyond_the_limit(const std::string& from, const std::string& to) {
    const defrec::test::TestContext context;
    defrec_template surface = nullptr;
    if (defrec_template_load(context.get(), from.c_str(), &surface) != DEFREC_OK) return 1;
    rlimit limit{};
    getrlimit(RLIMIT_FSIZE, &limit);
    limit.rlim_cur = 1000;
    if (setrlimit(RLIMIT_FSIZE, &limit) != 0) return 2;
    if (defrec_template_save(surface, to.c_str()) != DEFREC_ERROR_IO) return 3;
    if (!defrec::test::contains(defrec_last_error(), "limit on file sizes")) return 4;
    struct sigaction action {};
    sigset_t blocked, size_signal;
    sigaction(SIGXFSZ, nullptr, &action);
    pthread_sigmask(SIG_SETMASK, nullptr, &blocked);
    if (action.sa_handler != SIG_DFL || sigismember(&blocked, SIGXFSZ) != 0) return 5;
    if (is_pending(SIGXFSZ)) return 6;
    // One that the application has yet to take stays.
    sigemptyset(&size_signal);
    sigaddset(&size_signal, SIGXFSZ);
    pthread_sigmask(SIG_BLOCK, &size_signal, nullptr);
    raise(SIGXFSZ);
    if (defrec_template_save(surface, to.c_str()) != DEFREC_ERROR_IO) return 7;
    if (!is_pending(SIGXFSZ)) return 8;
    defrec_template_release(surface);
    return 0;
}

}  // namespace

TEST_CASE("row 72: at the limit on file sizes saving fails, and the application gets no signal") {
    const defrec::test::TemporaryFolder folder;
    const std::string whole = folder.path() / "whole", cut = folder.path() / "cut";
    defrec::Template(square()).save(whole.c_str());
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) _exit(save_beyond_the_limit(whole, cut));
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0);
    CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("row 98: without descriptors a template is not loaded, and the reason is that") {
    const defrec::test::TemporaryFolder folder;
    const std::string path = folder.path() / "template";
    defrec::Template(square()).save(path.c_str());
    const defrec::test::TestContext context;
    rlimit before{};
    REQUIRE(getrlimit(RLIMIT_NOFILE, &before) == 0);
    const rlimit none{0, before.rlim_max};
    REQUIRE(setrlimit(RLIMIT_NOFILE, &none) == 0);
    defrec_template loaded = nullptr;
    const defrec_status status = defrec_template_load(context.get(), path.c_str(), &loaded);
    const std::string message = defrec_last_error();
    REQUIRE(setrlimit(RLIMIT_NOFILE, &before) == 0);
    CHECK(status == DEFREC_ERROR_IO);
    CHECK_MESSAGE(defrec::test::contains(message, "Too many open files"), message);
}
