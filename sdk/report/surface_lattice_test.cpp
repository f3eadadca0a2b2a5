// The lattice on a template: complete, on the surface, and honest about status.
#include "sdk/report/surface_lattice.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "sdk/report/surface_history.hpp"

using namespace defrec::cli;

namespace {

/// Vertices every 7 px, 9 x 6 of them, on the plane z = 50 + u; x = u, y = v.
TemplateRecord plane() {
    TemplateRecord result;
    for (int row = 0; row < 6; ++row)
        for (int column = 0; column < 9; ++column) {
            const float u = 3 + 7.0f * static_cast<float>(column),
                        v = 5 + 7.0f * static_cast<float>(row);
            result.vertex_uv.insert(result.vertex_uv.end(), {u, v});
            result.vertices.insert(result.vertices.end(), {u, v, 50 + u});
        }
    for (std::uint32_t row = 0; row < 5; ++row)
        for (std::uint32_t column = 0; column < 8; ++column) {
            const std::uint32_t a = 9 * row + column;
            result.triangles.insert(result.triangles.end(),
                                    {a, a + 1, a + 9, a + 1, a + 10, a + 9});
        }
    return result;
}

/// Without the triangles between the columns at u = 31 and u = 38.
TemplateRecord parted_plane() {
    const TemplateRecord whole = plane();
    TemplateRecord parted = whole;
    parted.triangles.clear();
    for (std::size_t i = 0; i < whole.triangles.size(); i += 3) {
        const std::uint32_t* corner = whole.triangles.data() + i;
        if (std::all_of(corner, corner + 3, [](std::uint32_t c) { return c % 9 <= 4; }) ||
            std::all_of(corner, corner + 3, [](std::uint32_t c) { return c % 9 >= 5; }))
            parted.triangles.insert(parted.triangles.end(), corner, corner + 3);
    }
    return parted;
}

FrameRecord frame_of(const TemplateRecord& reference) {
    FrameRecord frame;
    frame.vertices = reference.vertices;
    frame.vertex_status.assign(reference.vertices.size() / 3, VertexStatus::observed);
    return frame;
}

}  // namespace

TEST_CASE("the lattice covers the template without holes at any step") {
    const TemplateRecord reference = plane();
    for (const double step : {0.5, 1.0, 2.3, 3.5, 7.0}) {
        const SurfaceLattice lattice(reference, step);
        CHECK(lattice.size() == static_cast<std::size_t>(lattice.columns() * lattice.rows()));
        CHECK(lattice.columns() == static_cast<int>(56 / step) + 1);
        CHECK(lattice.triangles().size() / 6 ==
              static_cast<std::size_t>((lattice.columns() - 1) * (lattice.rows() - 1)));
    }
    CHECK(template_area(reference) == doctest::Approx(56 * 35));
}

TEST_CASE("nodes lie on the deformed surface") {
    const TemplateRecord reference = plane();
    const SurfaceLattice lattice(reference, 1.7);
    FrameRecord frame = frame_of(reference);
    for (std::size_t i = 0; i < frame.vertices.size(); i += 3) {
        frame.vertices[i] *= 2;
        frame.vertices[i + 2] += 0.5f * reference.vertices[i + 1];
    }
    LatticeState state;
    lattice.evaluate(frame, state);
    for (std::size_t n = 0; n < lattice.size(); ++n) {
        const float u = lattice.uv()[2 * n], v = lattice.uv()[2 * n + 1];
        CHECK(state.xyz[3 * n] == doctest::Approx(2 * u).epsilon(1e-5));
        CHECK(state.xyz[3 * n + 1] == doctest::Approx(v).epsilon(1e-5));
        CHECK(state.xyz[3 * n + 2] == doctest::Approx(50 + u + 0.5f * v).epsilon(1e-5));
        CHECK(std::isnan(state.error_mm[n]));
    }
}

TEST_CASE("a node is no more certain than its least certain corner, and not finite means unknown") {
    const TemplateRecord reference = plane();
    const SurfaceLattice lattice(reference, 3.5);
    FrameRecord frame = frame_of(reference);
    frame.expected_error_mm.assign(frame.vertex_status.size(), 0.25f);
    frame.vertex_status[0] = VertexStatus::extrapolated;
    frame.vertices.back() = std::numeric_limits<float>::quiet_NaN();
    LatticeState state;
    lattice.evaluate(frame, state);
    const auto status_at = [&](int column, int row) {
        return state.status[static_cast<std::size_t>(lattice.node(column, row))];
    };
    CHECK(status_at(0, 0) == VertexStatus::extrapolated);
    CHECK(status_at(8, 5) == VertexStatus::observed);
    CHECK(status_at(lattice.columns() - 1, lattice.rows() - 1) == VertexStatus::unknown);
    CHECK(state.error_mm[0] == doctest::Approx(0.25));
}

TEST_CASE("places without surface have no node") {
    TemplateRecord reference = plane();
    reference.triangles.resize(reference.triangles.size() / 2);
    const SurfaceLattice lattice(reference, 1);
    CHECK(lattice.size() < static_cast<std::size_t>(lattice.columns() * lattice.rows()));
    CHECK(lattice.node(0, lattice.rows() - 1) == -1);
    CHECK(lattice.node(-1, 0) == -1);
    CHECK(lattice.node(0, lattice.rows()) == -1);
}

TEST_CASE("nothing goes on across a step between pieces, nor across a cut") {
    const TemplateRecord parted = parted_plane();
    for (const double step : {3.5, 7.0, 10.0}) {
        CAPTURE(step);
        const SurfaceLattice lattice(parted, step);
        int crossings = 0;
        for (int row = 0; row < lattice.rows(); ++row)
            for (int column = 0; column + 1 < lattice.columns(); ++column) {
                const double u = 3 + column * step;
                const bool is_apart = u < 38 && u + step > 31;
                crossings += is_apart;
                CHECK(lattice.goes_on_right(column, row) == !is_apart);
                if (lattice.node(column, row) >= 0 && row + 1 < lattice.rows())
                    CHECK(lattice.goes_on_down(column, row));
            }
        CHECK(crossings > 0);
        const std::vector<std::uint32_t> triangles = lattice.triangles();
        CHECK(!triangles.empty());
        for (std::size_t i = 0; i < triangles.size(); i += 3)
            for (std::size_t k = 1; k < 3; ++k)
                CHECK((lattice.uv()[2 * triangles[i]] < 34) ==
                      (lattice.uv()[2 * triangles[i + k]] < 34));
    }
}

TEST_CASE("a surface that is parted later keeps its nodes, and is drawn parted in all frames") {
    SurfaceHistory history;
    history.set_template(plane());
    history.add(frame_of(plane()), "tracking");
    const std::size_t nodes = history.lattice().size(),
                      whole = history.lattice().triangles().size();
    // Tissue that joined at the same time is not drawn.
    TemplateRecord changed = parted_plane();
    changed.vertices.insert(changed.vertices.end(), {100, 5, 150});
    changed.vertex_uv.insert(changed.vertex_uv.end(), {100, 5});
    changed.triangles.insert(changed.triangles.end(), {8, 54, 17});
    history.change_template(changed);
    CHECK(history.lattice().size() == nodes);
    CHECK(history.moments().items().size() == 1);
    CHECK(history.lattice().triangles().size() < whole);
    CHECK(history.lattice().triangles().size() > whole * 3 / 4);
}

TEST_CASE("vertices without a place take only their own triangles with them") {
    TemplateRecord reference = plane();
    reference.vertex_uv[0] = reference.vertex_uv[1] = std::numeric_limits<float>::quiet_NaN();
    reference.vertices.back() = std::numeric_limits<float>::infinity();
    CHECK_NOTHROW(check_template(reference));
    const SurfaceLattice lattice(reference, 3.5);
    CHECK(lattice.node(0, 0) == -1);
    CHECK(lattice.node(lattice.columns() - 1, lattice.rows() - 1) == -1);
    CHECK(lattice.node(lattice.columns() / 2, lattice.rows() / 2) >= 0);
    CHECK(template_area(reference) == doctest::Approx(56 * 35 - 49));
    for (float& uv : reference.vertex_uv) uv = std::numeric_limits<float>::quiet_NaN();
    CHECK(SurfaceLattice(reference, 1).size() == 0);
}

TEST_CASE("a huge extent does not make a huge lattice") {
    TemplateRecord reference = plane();
    for (float& uv : reference.vertex_uv) uv *= 1e6f;
    const SurfaceLattice lattice(reference, 0.01);
    CHECK(double(lattice.columns()) * lattice.rows() < 5e6);
}

TEST_CASE("geometry must fit the template") {
    FrameRecord frame = frame_of(plane());
    CHECK(has_geometry(frame, 54));
    CHECK_FALSE(has_geometry(frame, 53));
    frame.expected_error_mm.resize(3);
    CHECK_FALSE(has_geometry(frame, 54));
    TemplateRecord broken = plane();
    broken.vertex_uv.pop_back();
    CHECK_THROWS_AS(check_template(broken), std::invalid_argument);
}
