// For tests: the files that `defrec register` reads, as text.
#pragma once

#include <algorithm>
#include <cstdio>
#include <initializer_list>
#include <string>

#include "sdk/registration/test_organ.hpp"

namespace defrec::cli {

inline std::string number(double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%.6f", value);
    return text;
}

inline std::string row(std::initializer_list<double> values) {
    std::string text;
    for (const double value : values) {
        if (!text.empty()) text += ',';
        text += number(value);
    }
    text += '\n';
    return text;
}

inline std::string obj_of(const TestMesh& mesh) {
    std::string text = "g liver\n";
    for (std::size_t i = 0; i < mesh.vertices.size() / 3; ++i) {
        const Eigen::Vector3d place = mesh.vertex(i);
        std::string line = row({place.x(), place.y(), place.z()});
        std::replace(line.begin(), line.end(), ',', ' ');
        text.append("v ").append(line);
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
        text += "f";
        for (std::size_t k = 0; k < 3; ++k)
            text.append(" ").append(std::to_string(mesh.triangles[i + k] + 1));
        text += "\n";
    }
    return text;
}

}  // namespace defrec::cli
