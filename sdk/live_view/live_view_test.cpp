// The live view as a browser, and as others, meet it.
#include "sdk/live_view/live_view.hpp"

#include <doctest/doctest.h>
#include <httplib.h>

#include <cstring>
#include <future>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <thread>
#include <tuple>

#include "sdk/io/exit_code.hpp"
#include "sdk/report/shown_state.hpp"

using namespace defrec::cli;

namespace {

constexpr int kWidth = 96, kHeight = 64;

LiveView made(std::uint16_t port = 0) {
    return LiveView(port, {"a <sequence>", "a device", "1.2.3"},
                    [](const float* xyz, std::size_t count, float* uv) {
                        for (std::size_t i = 0; i < count; ++i) {
                            uv[2 * i] = xyz[3 * i] + kWidth / 2.0f;
                            uv[2 * i + 1] = xyz[3 * i + 1] + kHeight / 2.0f;
                        }
                    });
}

TemplateRecord triangle() {
    return {{-9, -9, 80, 9, -9, 80, 0, 9, 80}, {39, 23, 57, 23, 48, 41}, {0, 1, 2}};
}

FrameRecord frame(std::int64_t index) {
    FrameRecord record;
    record.index = index;
    record.state = "tracking";
    record.frame_ms = 20;
    record.stage_ms = {{"align", 1.5}, {"lm", 2}, {"align", 0.25}};
    record.observed_share = 0.5;
    record.vertices = triangle().vertices;
    record.vertex_status.assign(3, VertexStatus::extrapolated);
    record.expected_error_mm.assign(3, 0.25f);
    return record;
}

// A browser that was given the address.
class Browser {
  public:
    explicit Browser(const LiveView& view)
        : port_(std::stoi(view.url().substr(view.url().rfind(':') + 1))),
          token_(view.url().substr(view.url().find("token=") + 6)),
          client_("127.0.0.1", port_) {
        client_.set_read_timeout(20, 0);
    }

    httplib::Result get(const std::string& path, httplib::Headers headers = {}) {
        headers.emplace("X-Token", token_);
        return client_.Get(path, headers);
    }
    httplib::Result post(const std::string& path, const std::string& body) {
        return client_.Post(path, {{"X-Token", token_}}, body, "application/json");
    }
    int port() const { return port_; }
    const std::string& token() const { return token_; }
    httplib::Client& client() { return client_; }

  private:
    int port_;
    std::string token_;
    httplib::Client client_;
};

struct Packet {
    nlohmann::json header;
    std::map<std::string, std::string> sections;

    explicit Packet(const std::string& body) {
        std::uint32_t length = 0;
        REQUIRE(body.size() >= 4);
        std::memcpy(&length, body.data(), 4);
        header = nlohmann::json::parse(body.substr(4, length));
        std::size_t at = 4 + length;
        for (const auto& section : header["sections"]) {
            const auto bytes = section[1].get<std::size_t>();
            sections[section[0]] = body.substr(at, bytes);
            at += (bytes + 3) / 4 * 4;
        }
        CHECK(at == body.size());
    }
};

// The answer to a browser that waits, while frames with these indices come.
Packet watched(LiveView& view, Browser& browser, const std::string& path, std::int64_t index,
               const std::vector<ViewPoint>& points = {}, const cv::Mat& left = {},
               const std::vector<TargetEstimate>& targets = {}, const PlanEstimate& plan = {}) {
    auto answer = std::async(std::launch::async, [&] { return browser.get(path); });
    const cv::Mat image =
        left.empty() ? cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(40, 60, 160)) : left;
    while (answer.wait_for(std::chrono::milliseconds(5)) != std::future_status::ready) {
        FrameRecord record = frame(index++);
        record.targets = targets;
        record.plan = plan;
        view.add(image, record, points);
    }
    const httplib::Result result = answer.get();
    REQUIRE(result);
    REQUIRE(result->status == 200);
    return Packet(result->body);
}

}  // namespace

TEST_CASE("a frame says of which views its reasons speak") {
    LiveView view = made();
    Browser browser(view);
    const cv::Mat black = cv::Mat::zeros(kHeight, kWidth, CV_8UC3);
    int index = 0;
    for (const char* views : {"right", "left", "both", ""}) {
        const std::string path = "/frame?after=" + std::to_string(index - 1);
        auto answer = std::async(std::launch::async, [&] { return browser.get(path); });
        while (answer.wait_for(std::chrono::milliseconds(5)) != std::future_status::ready) {
            FrameRecord record = frame(index++);
            record.faulty_views = views;
            view.add(black, record, {});
        }
        CHECK(Packet(answer.get()->body).header["moments"].back()[6] == views);
    }
}

TEST_CASE("a browser gets the page, and frames with pictures, surface and points") {
    LiveView view = made();
    Browser browser(view);
    const httplib::Result page = browser.client().Get("/?token=" + browser.token());
    REQUIRE(page);
    CHECK(page->status == 200);
    CHECK(page->body.find("<!doctype html>") == 0);
    CHECK(page->get_header_value("Content-Security-Policy").find("default-src 'none'") == 0);
    CHECK(page->get_header_value("Cache-Control") == "no-store");

    view.set_template(triangle());
    const std::vector<ViewPoint> points = {
        {4, VertexStatus::observed, 10, 20, 1, 2, 80, 0.125, "vessel", true},
        {5, VertexStatus::unknown}};
    const Packet packet = watched(view, browser, "/frame?after=-1&overlay=1", 3, points);
    CHECK(packet.header["frame"] >= 3);
    CHECK(packet.header["sequence"] == "a <sequence>");
    CHECK(packet.header["width"] == kWidth);
    CHECK(packet.header["points"] ==
          nlohmann::json({{4, 0, true, "vessel", 10, 20, 1, 2, 80, 0.125}, {5, 2, false, ""}}));
    CHECK(packet.header["stages"].dump() == R"([["align",1.5],["lm",2.0],["align",0.25]])");
    CHECK(packet.header["moments"][0].dump() ==
          R"([3,0.0,"tracking","",20.0,0.5,"","",false,"",null,0.0])");
    for (const char* name : {"left", "overlay"}) {
        const std::string& bytes = packet.sections.at(name);
        const cv::Mat image = cv::imdecode(std::vector<char>(bytes.begin(), bytes.end()), 1);
        CHECK(image.cols == kWidth);
        CHECK(image.rows == kHeight);
    }
    CHECK(packet.sections.at("left") != packet.sections.at("overlay"));
    float uv[6];
    REQUIRE(packet.sections.at("uv").size() == sizeof uv);
    std::memcpy(uv, packet.sections.at("uv").data(), sizeof uv);
    CHECK(uv[0] == 39);
    CHECK(packet.sections.at("status") == std::string(3, '\1'));

    const httplib::Result surface = browser.get("/surface");
    REQUIRE(surface);
    const Packet triangles(surface->body);
    CHECK(triangles.header["surface"] == packet.header["surface"]);
    CHECK(triangles.sections.at("triangles").size() == 3 * sizeof(std::uint32_t));
}

TEST_CASE("targets come with their pixel and their expected error in mm and pixels") {
    LiveView view = made();
    Browser browser(view);
    CHECK(watched(view, browser, "/frame?after=-1", 0).header["targets"].empty());
    std::vector<TargetEstimate> targets = {
        {{VertexStatus::extrapolated, {4, -8, 90}, {1, 0, 0, 1, 0, 2}, 7}, 12.5f},
        {{VertexStatus::unknown, {}, {}, -2}, 3},
        {{VertexStatus::observed, {0, 0, 80}, {0.25f, 0, 0, 0, 0, 0}, 9'007'199'254'740'993}}};
    const Packet packet = watched(view, browser, "/frame?after=99&overlay=1", 100, {}, {}, targets);
    CHECK(packet.header["target_count"] == 3);
    CHECK(packet.header["targets_placed"] == 2);
    CHECK(packet.header["targets"] ==
          nlohmann::json({{7, 12.5, 1, 52, 24, 2, 4, -8, 90, 2},
                          {-2, 3, 2},
                          {9'007'199'254'740'993, nullptr, 0, 48, 32, 0.5, 0, 0, 80, 0.5}}));

    targets.assign(1001, targets[0]);
    for (std::size_t i = 0; i < targets.size(); ++i) targets[i].id = static_cast<std::int64_t>(i);
    const Packet many = watched(view, browser, "/frame?after=199", 200, {}, {}, targets);
    CHECK(many.header["target_count"] == 1001);
    REQUIRE(many.header["targets"].size() == 334);
    CHECK(many.header["targets"][333][0] == 999);
}

TEST_CASE("a plan comes as outlines with errors in pixels, targets, depths, and a mesh") {
    LiveView view = made();
    Browser browser(view);
    view.set_template(triangle());
    CHECK(watched(view, browser, "/frame?after=-1", 0).header["plan"].is_null());
    PlanEstimate plan;
    plan.model = std::make_shared<const PlanModel>(PlanModel{
        {0, 1, 2, 0, 2, 3, 4, 5, 6}, {{"tumour", 0, 2}, {"vessel", 0, 1}, {"duct", 2, 1}}});
    plan.vertices = {-20, -10, 80, 20, -10, 80, 20, 10, 80, -20, 10,
                     80,  0,   0,  86, 0,   1,  87, 1,  0,  88};
    plan.status.assign(7, VertexStatus::extrapolated);
    plan.expected_error_mm.assign(7, 3.0f);
    plan.parts = {{VertexStatus::extrapolated, {0, 0, 80}, {9, 0, 0, 0, 0, 0}, 0, "tumour"},
                  {VertexStatus::unknown, {}, {}, 1, "vessel"}};
    plan.targets = {{VertexStatus::extrapolated, {4, -8, 90}, {1, 0, 0, 1, 0, 2}, 0}};
    plan.targets.push_back(plan.targets[0]);
    plan.targets[1].id = 1;
    plan.targets[1].name = "tumour centre";
    const Packet packet =
        watched(view, browser, "/frame?after=99&overlay=1", 100, {}, {}, {}, plan);
    const auto parts = packet.header["plan"]["parts"];
    REQUIRE(parts.size() == 3);
    CHECK(parts[0][0] == "tumour");
    CHECK(parts[0][1] == 1);
    CHECK(parts[0][2] == 3);
    REQUIRE(parts[0][3].size() == 1);
    CHECK(parts[0][3][0].size() > 20);
    for (const auto& point : parts[0][3][0]) {
        const double u = point[0].get<double>() - kWidth / 2.0,
                     v = point[1].get<double>() - kHeight / 2.0;
        CHECK((std::abs(std::abs(u) - 20) < 1.1 || std::abs(std::abs(v) - 10) < 1.1));
        CHECK(point[2] == 3);
        CHECK(point[3] == 0);
    }
    CHECK(parts[0][4].is_null());  // its corners are beside the surface
    CHECK(parts[1][1] == 2);
    CHECK(parts[2][4] == nlohmann::json({6, 0, 0, 86, 0, 0, 80}));
    CHECK(packet.header["plan"]["targets"] ==
          nlohmann::json({{0, 10, 1, 52, 24, 2, 4, -8, 90, 2},
                          {"tumour centre", 10, 1, 52, 24, 2, 4, -8, 90, 2}}));
    CHECK(packet.header["plan"]["target_count"] == 2);
    CHECK(packet.header["plan"]["targets_placed"] == 2);
    const httplib::Result surface = browser.get("/surface");
    REQUIRE(surface);
    const Packet mesh(surface->body);
    CHECK(mesh.header["plan_parts"] == nlohmann::json({{0, 2}, {2, 1}, {3, 1}}));
    CHECK(mesh.sections.at("plan_triangles").size() == 4 * 3 * sizeof(std::uint32_t));
    // No two parts share a vertex: 4, 3 and 3 of them.
    CHECK(packet.sections.at("plan_xyz").size() == 10 * 3 * sizeof(float));
    CHECK(packet.sections.at("plan_error").size() == 10 * sizeof(float));

    plan.targets.pop_back();
    plan.vertices.clear();
    plan.status.clear();
    plan.expected_error_mm.clear();
    plan.targets[0].status = VertexStatus::unknown;
    const Packet lost = watched(view, browser, "/frame?after=199", 200, {}, {}, {}, plan);
    CHECK(lost.header["plan"]["parts"][0][3].empty());
    CHECK(lost.header["plan"]["parts"][2][4].is_null());
    CHECK(lost.header["plan"]["targets"] == nlohmann::json({{0, nullptr, 2}}));
    CHECK(lost.header["plan"]["target_count"] == 1);
    CHECK(lost.header["plan"]["targets_placed"] == 0);
    CHECK(lost.sections.at("plan_xyz").empty());
}

TEST_CASE("what a browser missed of states comes with the next frame, pictures do not") {
    LiveView view = made();
    Browser browser(view);
    const cv::Mat left(kHeight, kWidth, CV_8UC1, cv::Scalar(90));
    for (int index = 0; index < 5; ++index) view.add(left, frame(index), {});
    const Packet packet = watched(view, browser, "/frame?after=1&overlay=0", 5, {}, left);
    CHECK(packet.header["frame"] >= 5);
    CHECK(packet.header["moments"][0][0] == 2);
    CHECK(packet.sections.count("overlay") == 0);
}

TEST_CASE("a page hears that the template of targets was given up") {
    LiveView view = made();
    Browser browser(view);
    CHECK(watched(view, browser, "/frame?after=-1", 0).header["is_given_up"] == false);
    FrameRecord without = frame(1000);
    without.state = "initialising";
    view.add(cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(90)), without, {});
    const Packet packet = watched(view, browser, "/frame?after=999", 1001);
    CHECK(packet.header["moments"][0][2] == "given-up");
    CHECK(packet.header["is_given_up"] == true);
}

TEST_CASE("a page hears of points that never had a place, and of errors that are too large") {
    LiveView view = made();
    Browser browser(view);
    ViewPoint given{7}, clicked{8, VertexStatus::observed, 2, 3, 0, 0, 80, 0.2, "", true};
    given.is_chosen = true;
    const Packet first = watched(view, browser, "/frame?after=-1", 0, {given, clicked, {9}});
    CHECK(first.header["never_placed"] == nlohmann::json{7});
    CHECK(first.header["moments"].back()[2] == "degraded");
    CHECK(first.header["moments"].back()[10]["never"] == nlohmann::json::parse(R"([["#7"],[],1])"));
    given.status = VertexStatus::extrapolated;
    given.expected_error_mm = ShownState::kMostErrorMm + 1;
    const Packet placed = watched(view, browser, "/frame?after=999", 1000, {given, clicked});
    CHECK(placed.header["never_placed"].empty());
    CHECK(placed.header["moments"].back()[2] == "degraded");
    CHECK(placed.header["moments"].back()[10]["large"] ==
          nlohmann::json::parse(R"([["#7"],[4.0],1])"));
    given.status = clicked.status = VertexStatus::unknown;
    const Packet lost = watched(view, browser, "/frame?after=1999", 2000, {given, clicked});
    CHECK(lost.header["never_placed"].empty());
    CHECK(lost.header["moments"].back()[2] == "degraded");
    CHECK(lost.header["moments"].back()[10]["lost"] ==
          nlohmann::json::parse(R"([["#7","#8"],[],2])"));
}

TEST_CASE("targets with errors that are too large are less sure, and named, the worst first") {
    LiveView view = made();
    Browser browser(view);
    std::vector<TargetEstimate> targets(2);
    for (TargetEstimate& target : targets) {
        target.id = 16 + (&target - targets.data());
        target.status = VertexStatus::extrapolated;
        target.covariance[0] = 4;
    }
    const Packet good = watched(view, browser, "/frame?after=-1", 0, {}, {}, targets);
    CHECK(good.header["moments"].back()[2] == "tracking");
    CHECK(good.header["moments"].back()[10].is_null());
    targets[0].covariance[0] = 3.04f * 3.04f;  // 3.0 mm, as it is shown
    LiveView rounded = made();
    Browser third(rounded);
    const Packet shown = watched(rounded, third, "/frame?after=-1", 0, {}, {}, targets);
    CHECK(shown.header["moments"].back()[2] == "tracking");
    targets[0].covariance[0] = 16;
    targets[1].covariance[0] = 25;
    targets[1].name = "vessel";
    LiveView other = made();
    Browser second(other);
    const Packet bad = watched(other, second, "/frame?after=-1", 0, {}, {}, targets);
    CHECK(bad.header["moments"].back()[2] == "degraded");
    CHECK(bad.header["moments"].back()[10]["targets"] ==
          nlohmann::json::parse(R"([["vessel","target 16"],[5.0,4.0],2])"));
}

TEST_CASE("a page hears of outages, and of what is still shown for the sake of frames before") {
    LiveView view = made();
    Browser browser(view);
    double ms = 0;
    int index = 0;
    const auto add = [&](const char* state, const char* reasons) {
        FrameRecord record = frame(index++);
        record.timestamp_ms = ms += 100;
        record.state = state;
        record.reasons = reasons;
        view.add(cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(90)), record, {});
    };
    for (int i = 0; i < 9; ++i) add("tracking", "");
    for (int i = 0; i < 5; ++i) add("degraded", "occluded");
    add("tracking", "");
    ms += 5000;
    add("tracking", "");
    auto answer = std::async(std::launch::async, [&] { return browser.get("/frame?after=-1"); });
    while (answer.wait_for(std::chrono::milliseconds(5)) != std::future_status::ready)
        add("tracking", "");
    const Packet packet(answer.get()->body);
    const nlohmann::json& moments = packet.header["moments"];
    CHECK(moments[12][2] == "tracking");  // it is less sure for a while first
    CHECK(moments[13][2] == "degraded");
    CHECK(moments[13][8] == false);
    CHECK(moments[14][2] == "degraded");
    CHECK(moments[14][8] == true);
    CHECK(moments[14][9] == "occluded");
    CHECK(moments[15][2] == "relocalised");
    CHECK(moments[15][7] == "resumed");
    CHECK(moments[15][11] == 5100);
    CHECK(packet.header["outage_ms"].get<double>() >= 1000);
}

TEST_CASE("points that are removed are not named where their frame is still told of") {
    LiveView view = made();
    Browser browser(view);
    ViewPoint seen{8, VertexStatus::observed, 2, 3, 0, 0, 80, 0.2, "", true}, first{6}, second{7};
    first.is_chosen = second.is_chosen = true;
    double ms = 0;
    int index = 0;
    const auto add = [&](std::vector<ViewPoint> points) {
        FrameRecord record = frame(index++);
        record.timestamp_ms = ms += 100;
        view.add(cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(90)), record, std::move(points));
    };
    for (int i = 0; i < 3; ++i) add({seen, first, second});
    add({seen, second});
    add({seen});
    auto answer = std::async(std::launch::async, [&] { return browser.get("/frame?after=-1"); });
    while (answer.wait_for(std::chrono::milliseconds(5)) != std::future_status::ready) add({seen});
    const nlohmann::json moments = Packet(answer.get()->body).header["moments"];
    CHECK(moments[2][10]["never"] == nlohmann::json::parse(R"([["#6","#7"],[],2])"));
    CHECK(moments[3][10]["never"] == nlohmann::json::parse(R"([["#7"],[],1])"));
    CHECK(moments[4][2] == "degraded");
    CHECK(moments[4][8] == true);
    CHECK(moments[4][10]["never"] == nlohmann::json::parse("[[],[],0]"));
    CHECK(moments[4][10]["removed"] == 1);
}

TEST_CASE("where nobody waited for the last frame the next is shown, and clicks count") {
    LiveView view = made();
    Browser browser(view), later(view);
    watched(view, browser, "/frame?after=-1", 0);
    CHECK(view.waiting() == 0);
    view.add(cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(90)), frame(1000), {});
    CHECK(browser.post("/points", R"({"u":10.5,"v":20})")->status == 202);
    CHECK(watched(view, later, "/frame?after=-1", 1001).header["frame"] >= 1001);
}

TEST_CASE("nobody without the token, from another host's name or another origin gets anything") {
    LiveView view = made();
    Browser browser(view);
    const std::string own = "127.0.0.1:" + std::to_string(browser.port());
    const httplib::Headers token = {{"X-Token", browser.token()}};
    for (const char* path : {"/", "/?token=", "/?token=00000000000000000000000000000000",
                             "/surface", "/checks", "/frame?after=-1", "/nothing"}) {
        CAPTURE(path);
        const httplib::Result refused = browser.client().Get(path);
        REQUIRE(refused);
        CHECK(refused->status == 403);
        CHECK(refused->body.find(browser.token()) == std::string::npos);
        // The page's address is opened by people.
        const bool is_page = std::string(path).size() == 1 || path[1] == '?';
        CHECK((refused->body.find("What to do: open the address") != std::string::npos) == is_page);
    }
    CHECK(browser.client().Get("/surface", {{"X-Token", browser.token() + "0"}})->status == 403);
    for (const char* host : {"evil.example", "evil.example:80", "127.0.0.2"})
        CHECK(browser.get("/surface", {{"Host", host}})->status == 403);
    for (const std::string& origin :
         {std::string("https://evil.example"), std::string("null"), "https://" + own})
        CHECK(browser.get("/surface", {{"Origin", origin}})->status == 403);
    CHECK(browser.get("/surface", {{"Origin", "http://" + own}})->status == 200);
    CHECK(browser.get("/nothing")->status == 404);
    CHECK(browser.client().Post("/points", {}, R"({"u":1,"v":1})", "application/json")->status ==
          403);
    CHECK(view.take_commands().empty());
}

TEST_CASE("clicks and the record button become commands; nonsense does not") {
    LiveView view = made();
    Browser browser(view);
    CHECK(browser.post("/points", R"({"u":1,"v":1})")->status == 400);  // there is no frame yet
    watched(view, browser, "/frame?after=-1", 0);
    CHECK(browser.post("/points", R"({"u":10.5,"v":20})")->status == 202);
    CHECK(browser.post("/recording", R"({"on":true})")->status == 202);
    for (const char* body : {"", "[]", "{}", R"({"u":"1","v":2})", R"({"u":96,"v":2})",
                             R"({"u":1e999,"v":2})", R"({"u":1,"v":-1})", "\xff\xfe"}) {
        CAPTURE(body);
        CHECK(browser.post("/points", body)->status == 400);
    }
    CHECK(browser.post("/recording", R"({"on":1})")->status == 400);
    CHECK(browser.post("/points", R"({"id":4,"removed":true})")->status == 202);
    CHECK(browser.post("/points", R"({"id":5,"name":"vessel"})")->status == 202);
    for (const char* body : {R"({"id":4})", R"({"id":4,"removed":false})", R"({"id":"4"})",
                             R"({"id":4,"name":7})", R"({"id":4.5,"removed":true})"})
        CHECK(browser.post("/points", body)->status == 400);
    CHECK(browser.post("/points", R"({"id":5,"name":")" + std::string(81, 'x') + "\"}")->status ==
          400);
    const httplib::Result too_much = browser.post("/points", std::string(100000, ' '));
    REQUIRE(too_much);
    CHECK(too_much->status == 413);
    const std::vector<ViewCommand> commands = view.take_commands();
    REQUIRE(commands.size() == 4);
    CHECK(commands[0].kind == ViewCommand::Kind::kFollowPoint);
    CHECK(commands[0].u == 10.5);
    CHECK(commands[0].v == 20);
    CHECK(commands[1].kind == ViewCommand::Kind::kRecord);
    CHECK(commands[1].is_on);
    CHECK(commands[2].kind == ViewCommand::Kind::kRemovePoint);
    CHECK(commands[2].id == 4);
    CHECK(commands[3].kind == ViewCommand::Kind::kNamePoint);
    CHECK(commands[3].id == 5);
    CHECK(commands[3].name == "vessel");
    for (int i = 0; i < 64; ++i) CHECK(browser.post("/points", R"({"u":1,"v":1})")->status == 202);
    CHECK(browser.post("/points", R"({"u":1,"v":1})")->status == 503);
}

TEST_CASE("checks of video and calibration are handed on as they were given, once there are any") {
    LiveView view = made();
    Browser browser(view);
    CHECK(browser.get("/checks")->status == 204);
    CHECK(watched(view, browser, "/frame?after=-1", 0).header["has_checks"] == false);
    const std::string checks = R"({"findings":[{"what":"a <b>sentence</b>"}]})";
    view.set_checks(checks);
    CHECK(watched(view, browser, "/frame?after=99", 100).header["has_checks"] == true);
    const httplib::Result answer = browser.get("/checks");
    REQUIRE(answer);
    CHECK(answer->status == 200);
    CHECK(answer->body == checks);
    CHECK(answer->get_header_value("Content-Type") == "application/json");
}

TEST_CASE("browsers that wait are told that the run has ended") {
    auto view = std::unique_ptr<LiveView>(new LiveView(made()));
    Browser browser(*view);
    auto answer = std::async(std::launch::async, [&] { return browser.get("/frame?after=-1"); });
    while (view->waiting() == 0) std::this_thread::yield();
    view.reset();
    const httplib::Result result = answer.get();
    REQUIRE(result);
    CHECK(result->status == 410);
}

TEST_CASE("a browser that is between two requests when the run ends hears of it") {
    auto view = std::unique_ptr<LiveView>(new LiveView(made()));
    Browser browser(*view);
    watched(*view, browser, "/frame?after=-1", 0);
    const auto begin = std::chrono::steady_clock::now();
    auto end = std::async(std::launch::async, [&] { view.reset(); });
    const httplib::Result result = browser.get("/frame?after=1000");
    // Where this machine is so slow that the time for it is over, nobody may be there to ask.
    if (std::chrono::steady_clock::now() - begin < std::chrono::seconds(2)) REQUIRE(result);
    if (result) CHECK(result->status == 410);
    end.wait();
}

TEST_CASE("the end waits for each page that watches, and for those alone") {
    LiveView view = made();
    Browser browser(view), slow(view);
    watched(view, browser, "/frame?after=-1&page=a", 0);
    watched(view, slow, "/frame?after=-1&page=b", 100);
    view.end();
    auto told = std::async(std::launch::async,
                           [&] { view.wait_for_pages(std::chrono::milliseconds(600000)); });
    CHECK(browser.get("/frame?after=1000&page=a")->status == 410);
    CHECK(told.wait_for(std::chrono::milliseconds(50)) == std::future_status::timeout);
    CHECK(slow.get("/frame?after=1000&page=b")->status == 410);
    told.wait();
}

TEST_CASE("changes of state are kept longer than frames") {
    LiveView view = made();
    Browser browser(view);
    const cv::Mat left(kHeight, kWidth, CV_8UC1, cv::Scalar(90));
    for (int index = 0; index < 3000; ++index) {
        FrameRecord record = frame(index);
        if (index >= 500) record.state = "lost";
        if (index >= 510) record.state = "relocalised";
        view.add(left, record, {});
    }
    const Packet packet = watched(view, browser, "/frame?after=-1", 3000, {}, left);
    CHECK(packet.header["age_ms"] >= 0);
    CHECK(packet.header["waited_ms"] >= 0);
    const auto& moments = packet.header["moments"];
    CHECK(moments.size() < 700);
    REQUIRE(moments.size() > 600);
    for (const auto& [at, index, state] :
         {std::tuple{0, 0, "tracking"}, {1, 500, "lost"}, {2, 510, "relocalised"}}) {
        CHECK(moments[at][0] == index);
        CHECK(moments[at][2] == state);
    }
}

TEST_CASE("a port that is taken is an error that says what to do") {
    const LiveView view = made();
    const int port = Browser(view).port();
    try {
        made(static_cast<std::uint16_t>(port));
        FAIL("two views listen at one port");
    } catch (const CliError& error) {
        CHECK(error.code() == ExitCode::kOutput);
        CHECK_MESSAGE(std::strstr(error.what(), "Choose another port") != nullptr, error.what());
    }
}

TEST_CASE("pages get the program's last message, with its number") {
    LiveView view = made();
    Browser browser(view);
    CHECK(watched(view, browser, "/frame?after=-1", 0).header["message"]["number"] == 0);
    view.tell("one");
    view.tell("a recording failed");
    const nlohmann::json message = watched(view, browser, "/frame?after=-1", 100).header["message"];
    CHECK(message["number"] == 2);
    CHECK(message["text"] == "a recording failed");
}
