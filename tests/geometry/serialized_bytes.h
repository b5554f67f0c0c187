// Writes files of Mitsuba 0.6's meshes, sound and hostile.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <string>
#include <vector>

namespace nacre::testing_support {

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class Number>
void append_numbers(std::string& bytes, const std::vector<double>& numbers) {
  for (const double number : numbers) append(bytes, static_cast<Number>(number));
}

// What a mesh is made of in a file. By default a square of two triangles.
struct SerializedContent {
  std::uint32_t flags = 0;  // precision and colours are set by what is there
  std::vector<double> positions{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, normals, uvs, colors;
  std::vector<std::uint32_t> corners{0, 1, 2, 0, 2, 3};
  std::uint64_t vertices = 4, triangles = 2;
  bool doubles = false;
  std::string name = "square";
};

inline std::string numbers_of(const SerializedContent& content, int version) {
  std::string bytes;
  std::uint32_t flags = content.flags | (content.doubles ? 0x2000 : 0x1000);
  if (!content.normals.empty()) flags |= 1;
  if (!content.uvs.empty()) flags |= 2;
  if (!content.colors.empty()) flags |= 8;
  append(bytes, flags);
  if (version == 4) bytes.append(content.name.c_str(), content.name.size() + 1);
  append(bytes, content.vertices);
  append(bytes, content.triangles);
  for (const auto* numbers : {&content.positions, &content.normals, &content.uvs, &content.colors})
    content.doubles ? append_numbers<double>(bytes, *numbers) : append_numbers<float>(bytes, *numbers);
  for (const std::uint32_t corner : content.corners) append(bytes, corner);
  return bytes;
}

inline std::string deflate_bytes(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
           bytes.size());
  packed.resize(size);
  return packed;
}

inline std::string header(std::uint16_t version, std::uint16_t magic = 0x041C) {
  std::string bytes;
  append(bytes, magic);
  append(bytes, version);
  return bytes;
}

inline void append_offset(std::string& bytes, int version, std::uint64_t offset) {
  if (version == 4)
    append(bytes, offset);
  else
    append(bytes, static_cast<std::uint32_t>(offset));
}

// A file of streams that are compressed already.
inline std::string file_of_streams(const std::vector<std::string>& streams, std::uint16_t version) {
  std::string bytes;
  std::vector<std::uint64_t> offsets;
  for (const std::string& stream : streams) {
    offsets.push_back(bytes.size());
    bytes += header(version) + stream;
  }
  for (const std::uint64_t offset : offsets) append_offset(bytes, version, offset);
  append(bytes, static_cast<std::uint32_t>(streams.size()));
  return bytes;
}

inline std::string file_of(const std::vector<SerializedContent>& meshes, std::uint16_t version) {
  std::vector<std::string> streams;
  for (const SerializedContent& mesh : meshes) streams.push_back(deflate_bytes(numbers_of(mesh, version)));
  return file_of_streams(streams, version);
}

}  // namespace nacre::testing_support
