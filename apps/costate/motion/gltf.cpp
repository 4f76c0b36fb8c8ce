#include "gltf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <tuple>

#include "base64.h"
#include "costate/base/version.h"
#include "costate/json_text.h"

namespace costate::app {

namespace {

// Numbers of the format.
constexpr int kFloat = 5126, kUnsignedInt = 5125, kArrayBuffer = 34962, kElementArrayBuffer = 34963;

class GltfWriter {
 public:
  GltfWriter(const Stage& stage, const std::string& title) : stage_(stage) {
    j_["asset"] = {{"version", "2.0"}, {"generator", fmt::format("costate {}", version)}};
    j_["scene"] = 0;
    j_["scenes"] = {{{"name", title.empty() ? "scene" : title}, {"nodes", {0}}}};
    j_["nodes"] = Json::array();
    for (const char* key : {"meshes", "materials", "accessors", "bufferViews"}) j_[key] = Json::array();
    add_root();
    add_motion();
    if (animation_.at("channels").empty()) return;
    j_["animations"] = {animation_};
  }

  Json take(const std::string& uri) {
    Json buffer;
    buffer["byteLength"] = bytes_.size();
    if (!uri.empty()) buffer["uri"] = uri;
    j_["buffers"] = {buffer};
    return std::move(j_);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  template <class Number>
  int add_view(const std::vector<Number>& numbers, std::optional<int> target) {
    while (bytes_.size() % 4 != 0) bytes_.push_back(0);
    Json view;
    view["buffer"] = 0;
    view["byteOffset"] = bytes_.size();
    view["byteLength"] = numbers.size() * sizeof(Number);
    if (target) view["target"] = *target;
    const std::size_t at = bytes_.size();
    bytes_.resize(at + numbers.size() * sizeof(Number));
    std::memcpy(bytes_.data() + at, numbers.data(), numbers.size() * sizeof(Number));
    j_["bufferViews"].push_back(view);
    return static_cast<int>(j_["bufferViews"].size()) - 1;
  }
  int add_accessor(int view, int component, std::size_t count, const char* type) {
    Json a;
    a["bufferView"] = view;
    a["componentType"] = component;
    a["count"] = count;
    a["type"] = type;
    j_["accessors"].push_back(a);
    return static_cast<int>(j_["accessors"].size()) - 1;
  }
  /// With the bounds that the format wants of times and positions.
  int add_floats(const std::vector<float>& x, int width, bool bounds, std::optional<int> target = {}) {
    const std::size_t n = static_cast<std::size_t>(width), count = x.size() / n;
    const char* type = width == 1 ? "SCALAR" : width == 3 ? "VEC3" : "VEC4";
    const int accessor = add_accessor(add_view(x, target), kFloat, count, type);
    if (!bounds) return accessor;
    std::vector<float> low(x.begin(), x.begin() + width), high = low;
    for (std::size_t i = 0; i < x.size(); ++i) {
      low[i % n] = std::min(low[i % n], x[i]);
      high[i % n] = std::max(high[i % n], x[i]);
    }
    j_["accessors"].back()["min"] = low;
    j_["accessors"].back()["max"] = high;
    return accessor;
  }

  void add_root() {
    Json root;
    root["name"] = "mechanism";
    const double h = std::sqrt(0.5);
    if (stage_.up == 2) root["rotation"] = {-h, 0, 0, h};  // z to y, y to -z
    if (stage_.up == 0) root["rotation"] = {0, 0, h, h};   // x to y, y to -x
    root["children"] = Json::array();
    j_["nodes"].push_back(root);
    animation_ = Json{{"name", "motion"}, {"channels", Json::array()}, {"samplers", Json::array()}};
  }

  int material(unsigned color, double opacity) {
    const auto [at, fresh] = materials_.try_emplace({color, opacity}, static_cast<int>(materials_.size()));
    if (!fresh) return at->second;
    const auto linear = [&](int shift) {
      const double c = ((color >> shift) & 0xff) / 255.0;
      return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    };
    Json m;
    m["pbrMetallicRoughness"] = {{"baseColorFactor", {linear(16), linear(8), linear(0), opacity}},
                                 {"metallicFactor", 0},
                                 {"roughnessFactor", 0.7}};
    m["doubleSided"] = true;
    if (opacity < 1) m["alphaMode"] = "BLEND";
    j_["materials"].push_back(m);
    return at->second;
  }

  /// A mesh of the stage in a colour.
  int mesh(const Solid& s) {
    const auto [at, fresh] = meshes_.try_emplace({s.mesh, s.color, s.opacity}, static_cast<int>(meshes_.size()));
    if (!fresh) return at->second;
    auto [data, missing] = data_.try_emplace(s.mesh, std::array<int, 3>{});
    if (missing) {
      const SolidMesh& m = stage_.meshes[static_cast<std::size_t>(s.mesh)];
      const auto flat = [](const std::vector<Eigen::Vector3f>& v) {
        std::vector<float> r;
        for (const auto& x : v) r.insert(r.end(), {x[0], x[1], x[2]});
        return r;
      };
      data->second = {
          add_floats(flat(m.corners), 3, true, kArrayBuffer), add_floats(flat(m.normals), 3, false, kArrayBuffer),
          add_accessor(add_view(m.triangles, kElementArrayBuffer), kUnsignedInt, m.triangles.size(), "SCALAR")};
    }
    const auto& [positions, normals, indices] = data->second;
    Json primitive;
    primitive["attributes"] = {{"POSITION", positions}, {"NORMAL", normals}};
    primitive["indices"] = indices;
    primitive["material"] = material(s.color, s.opacity);
    j_["meshes"].push_back({{"primitives", {primitive}}});
    return at->second;
  }

  void add_motion() {
    std::vector<float> times;
    for (const double t : stage_.times) {
      // Times are floats there and must increase.
      float x = static_cast<float>(t - stage_.times.front());
      if (!times.empty() && x <= times.back()) x = std::nextafter(times.back(), HUGE_VALF);
      times.push_back(x);
    }
    int input = -1;
    for (const Solid& s : stage_.solids) {
      if (stage_.meshes[static_cast<std::size_t>(s.mesh)].triangles.empty()) continue;
      const int node = static_cast<int>(j_["nodes"].size());
      std::vector<float> at, turn, scale;
      for (const Pose& p : s.poses) {
        for (int k = 0; k < 3; ++k) at.push_back(static_cast<float>(p.at[k]));
        for (int k = 0; k < 3; ++k) scale.push_back(static_cast<float>(p.scale[k]));
        const Eigen::Quaternionf q = p.turn.cast<float>().normalized();
        turn.insert(turn.end(), {q.x(), q.y(), q.z(), q.w()});
      }
      Json n;
      n["name"] = s.name;
      n["mesh"] = mesh(s);
      n["translation"] = std::vector<float>(at.begin(), at.begin() + 3);
      n["rotation"] = std::vector<float>(turn.begin(), turn.begin() + 4);
      n["scale"] = std::vector<float>(scale.begin(), scale.begin() + 3);
      j_["nodes"].push_back(n);
      j_["nodes"][0]["children"].push_back(node);
      const auto channel = [&](const char* path, const std::vector<float>& x, int width) {
        bool moves = false;
        for (std::size_t i = 0; i < x.size(); ++i) moves = moves || x[i] != x[i % static_cast<std::size_t>(width)];
        if (!moves) return;
        if (input < 0) input = add_floats(times, 1, true);
        Json sampler;
        sampler["input"] = input;
        sampler["interpolation"] = "LINEAR";
        sampler["output"] = add_floats(x, width, false);
        animation_["channels"].push_back(
            {{"sampler", animation_["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
        animation_["samplers"].push_back(sampler);
      };
      channel("translation", at, 3);
      channel("rotation", turn, 4);
      channel("scale", scale, 3);
    }
  }

  const Stage& stage_;
  Json j_, animation_;
  std::string bytes_;
  std::map<std::pair<unsigned, double>, int> materials_;
  std::map<std::tuple<int, unsigned, double>, int> meshes_;
  std::map<int, std::array<int, 3>> data_;  // of a mesh: positions, normals, indices
};

}  // namespace

std::string gltf_text(const Stage& stage, const std::string& title) {
  GltfWriter writer(stage, title);
  const std::string uri = "data:application/octet-stream;base64," + base64(writer.bytes());
  return json_text(writer.take(uri)) + "\n";
}

std::string glb_bytes(const Stage& stage, const std::string& title) {
  GltfWriter writer(stage, title);
  std::string data = writer.bytes(), text = json_text(writer.take(""));
  while (text.size() % 4 != 0) text += ' ';
  while (data.size() % 4 != 0) data += '\0';
  std::string file;
  const auto word = [&](std::size_t x) {
    for (int k = 0; k < 4; ++k) file += static_cast<char>(x >> (8 * k) & 0xff);
  };
  word(0x46546C67);  // "glTF"
  word(2);
  word(12 + 8 + text.size() + 8 + data.size());
  word(text.size());
  word(0x4E4F534A);  // "JSON"
  file += text;
  word(data.size());
  word(0x004E4942);  // "BIN"
  return file + data;
}

}  // namespace costate::app
