// The target of OpenMesh's readers. A half-edge mesh, the usual target, would duplicate the vertices of
// non-manifold and flipped faces; this one takes everything down as it comes.
#include "geometry/openmesh_reader.h"

#include <OpenMesh/Core/IO/reader/OBJReader.hh>
#include <OpenMesh/Core/IO/reader/OFFReader.hh>
#include <OpenMesh/Core/IO/reader/PLYReader.hh>
#include <OpenMesh/Core/IO/reader/STLReader.hh>
#include <algorithm>
#include <charconv>
#include <locale>
#include <sstream>
#include <utility>

#include "geometry/quiet_openmesh.h"
#include "geometry/text_lines.h"

namespace nacre {
namespace {

namespace om = OpenMesh;

class FaceCollector final : public om::IO::BaseImporter {
 public:
  // The OBJ reader sets the normal and texture coordinates of a vertex anew before each face that uses it;
  // the others set them once for each vertex.
  explicit FaceCollector(bool attributes_per_face) : per_face_(attributes_per_face) {}

  RawMesh take() {
    const std::size_t count = per_face_ ? raw_.corners.size() : raw_.positions.size();
    if (!per_face_) {
      raw_.normals = std::move(normals_);
      raw_.uvs = std::move(uvs_);
    }
    if (!raw_.normals.empty()) raw_.normals.resize(count, Vec3(0));
    if (!raw_.uvs.empty()) raw_.uvs.resize(count, Vec2(0));
    raw_.attributes_by_corner = per_face_;
    return std::move(raw_);
  }

  om::VertexHandle add_vertex(const om::Vec3f& p) override {
    raw_.positions.emplace_back(p[0], p[1], p[2]);
    return om::VertexHandle(static_cast<int>(raw_.positions.size()) - 1);
  }
  om::VertexHandle add_vertex() override { return add_vertex(om::Vec3f(0.0f)); }
  void set_point(om::VertexHandle v, const om::Vec3f& p) override {
    if (exists(v)) raw_.positions[index(v)] = {p[0], p[1], p[2]};
  }
  om::FaceHandle add_face(const VHandles& vertices) override {
    for (const om::VertexHandle v : vertices) raw_.corners.push_back(index(v));
    raw_.face_ends.push_back(raw_.corners.size());
    if (per_face_) {
      move_to_corners(vertices, normals_, raw_.normals);
      move_to_corners(vertices, uvs_, raw_.uvs);
    }
    return om::FaceHandle(static_cast<int>(raw_.face_ends.size()) - 1);
  }
  void set_normal(om::VertexHandle v, const om::Vec3f& n) override {
    set(normals_, v, Vec3(n[0], n[1], n[2]));
  }
  void set_texcoord(om::VertexHandle v, const om::Vec2f& uv) override { set(uvs_, v, Vec2(uv[0], uv[1])); }
  std::size_t n_vertices() const override { return raw_.positions.size(); }
  std::size_t n_faces() const override { return raw_.face_ends.size(); }
  std::size_t n_edges() const override { return 0; }

  // What is of no use here.
  void set_normal(om::VertexHandle, const om::Vec3d&) override {}
  void set_texcoord(om::VertexHandle, const om::Vec3f&) override {}
  void set_texcoord(om::HalfedgeHandle, const om::Vec2f&) override {}
  void set_texcoord(om::HalfedgeHandle, const om::Vec3f&) override {}
  om::HalfedgeHandle add_edge(om::VertexHandle, om::VertexHandle) override { return om::HalfedgeHandle(); }
  om::FaceHandle add_face(om::HalfedgeHandle) override { return om::FaceHandle(); }
  void add_face_texcoords(om::FaceHandle, om::VertexHandle, const std::vector<om::Vec2f>&) override {}
  void add_face_texcoords(om::FaceHandle, om::VertexHandle, const std::vector<om::Vec3f>&) override {}
  void set_face_texindex(om::FaceHandle, int) override {}
  void set_halfedge(om::VertexHandle, om::HalfedgeHandle) override {}
  void set_color(om::VertexHandle, const om::Vec3uc&) override {}
  void set_color(om::VertexHandle, const om::Vec4uc&) override {}
  void set_color(om::VertexHandle, const om::Vec3f&) override {}
  void set_color(om::VertexHandle, const om::Vec4f&) override {}
  void set_color(om::EdgeHandle, const om::Vec3uc&) override {}
  void set_color(om::EdgeHandle, const om::Vec4uc&) override {}
  void set_color(om::EdgeHandle, const om::Vec3f&) override {}
  void set_color(om::EdgeHandle, const om::Vec4f&) override {}
  void set_color(om::FaceHandle, const om::Vec3uc&) override {}
  void set_color(om::FaceHandle, const om::Vec4uc&) override {}
  void set_color(om::FaceHandle, const om::Vec3f&) override {}
  void set_color(om::FaceHandle, const om::Vec4f&) override {}
  void set_status(om::VertexHandle, const om::Attributes::StatusInfo&) override {}
  void set_status(om::HalfedgeHandle, const om::Attributes::StatusInfo&) override {}
  void set_status(om::EdgeHandle, const om::Attributes::StatusInfo&) override {}
  void set_status(om::FaceHandle, const om::Attributes::StatusInfo&) override {}
  void set_normal(om::FaceHandle, const om::Vec3f&) override {}
  void set_normal(om::FaceHandle, const om::Vec3d&) override {}
  void set_next(om::HalfedgeHandle, om::HalfedgeHandle) override {}
  void set_face(om::HalfedgeHandle, om::FaceHandle) override {}
  void request_face_texcoords2D() override {}
  void add_texture_information(int, std::string) override {}

 private:
  static std::uint32_t index(om::VertexHandle v) { return static_cast<std::uint32_t>(v.idx()); }
  bool exists(om::VertexHandle v) const { return index(v) < raw_.positions.size(); }

  template <class T>
  void set(std::vector<T>& values, om::VertexHandle v, const T& value) {
    if (!exists(v)) return;
    if (values.size() <= index(v)) values.resize(index(v) + 1, T(0));
    values[index(v)] = value;
  }
  template <class T>
  void move_to_corners(const VHandles& vertices, std::vector<T>& values, std::vector<T>& corners) const {
    if (values.empty()) return;
    corners.resize(raw_.corners.size() - vertices.size(), T(0));  // faces before the first with values
    for (const om::VertexHandle v : vertices)
      corners.push_back(index(v) < values.size() ? std::exchange(values[index(v)], T(0)) : T(0));
  }

  bool per_face_;
  RawMesh raw_;
  std::vector<Vec3> normals_;  // by vertex
  std::vector<Vec2> uvs_;
};

// After a stream has failed: whether it ended or does not hold what it should, and where.
[[noreturn]] void fail_read(std::istringstream& in, const GuardedFile& file, const RawMesh& raw,
                            const std::string& path) {
  in.exceptions(std::ios::goodbit);
  const bool ended = in.eof();
  in.clear();
  const auto at = static_cast<std::size_t>(std::max<std::streamoff>(in.tellg(), 0));
  const std::string_view text = in.view();
  if (ended || file.binary || at >= text.size())
    fail(ErrorCode::kSyntax, path, "the file ends after {} of {} vertices and {} of {} faces: truncated?",
         raw.positions.size(), file.vertices, raw.face_ends.size(), file.faces);
  // Parsing may have stopped inside of the word.
  std::size_t begin = at;
  while (begin > 0 && !is_blank(text[begin - 1]) && text[begin - 1] != '\n') --begin;
  std::string_view rest = text.substr(begin, text.find('\n', begin) - begin);
  const std::string_view word = take_word(rest);
  const auto line =
      std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(begin), '\n') + 1 + file.line_shift;
  double value = 0;
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool is_number = stop == word.data() + word.size();
  if (is_number && (error != std::errc{} || !(std::abs(value) <= double{std::numeric_limits<float>::max()})))
    fail(ErrorCode::kValue, path, "line {}: {} is not a finite number", line, quote_word(word));
  fail(ErrorCode::kSyntax, path, "line {}: {} is not {}", line, quote_word(word),
       is_number ? "an index" : "a number");
}

}  // namespace

RawMesh read_with_openmesh(MeshFormat format, GuardedFile file, const std::string& path) {
  const QuietOpenMesh quiet;
  om::IO::BaseReader* readers[] = {&om::IO::OBJReader(), &om::IO::PLYReader(), &om::IO::STLReader(),
                                   &om::IO::OFFReader()};
  om::IO::Options options(om::IO::Options::VertexNormal | om::IO::Options::VertexTexCoord);
  if (file.binary) options += om::IO::Options::Binary;
  FaceCollector collector(format == MeshFormat::kObj);
  std::istringstream in(std::move(file.content), std::ios::in | std::ios::binary);
  in.imbue(std::locale::classic());
  // The PLY reader counts on after a value that it could not read. (Those that read line by line would take
  // the end of the file for such a failure, but their guards leave nothing to fail.)
  if (format == MeshFormat::kPly) in.exceptions(std::ios::failbit | std::ios::badbit);
  try {
    if (!readers[static_cast<std::size_t>(format)]->read(in, collector, options))
      fail(ErrorCode::kSyntax, path, "OpenMesh cannot read the file");
  } catch (const std::ios_base::failure&) {
    fail_read(in, file, collector.take(), path);
  }
  RawMesh raw = collector.take();
  if (format == MeshFormat::kPly &&
      (raw.positions.size() != file.vertices || raw.face_ends.size() != file.faces))
    fail(ErrorCode::kSyntax, path, "the file ends after {} of {} vertices and {} of {} faces: truncated?",
         raw.positions.size(), file.vertices, raw.face_ends.size(), file.faces);
  return raw;
}

}  // namespace nacre
