// Does a scene, and do its pictures, keep the invariants S1 to S4 of render/scene/scene.h?
#pragma once

#include <cmath>
#include <string>

#include "render/scene/scene.h"
#include "render/scene/scene_at_time.h"
#include "render/scene/scene_extent.h"

namespace lucerna {

[[nodiscard]] inline bool PictureIsSound(const Picture& picture) {
  const auto values = static_cast<std::size_t>(picture.width) *
                      static_cast<std::size_t>(picture.height) *
                      static_cast<std::size_t>(picture.channels);
  for (const float value : picture.linear) {
    if (!(value >= 0) || !std::isfinite(value)) return false;
  }
  return values > 0 && (picture.channels == 1 || picture.channels == 3) &&
         picture.coded.size() + picture.linear.size() == values &&
         (picture.coded.empty() || picture.linear.empty());
}

// Empty when it does, else the first thing that is wrong.
[[nodiscard]] inline std::string WhatIsUnsound(const Scene& scene) {
  const auto traits_are_sound = [&](const ShapeTraits& traits) {
    return traits.material >= 0 &&
           static_cast<std::size_t>(traits.material) < scene.materials.size() &&
           traits.alpha >= 0 && traits.alpha <= 1 && traits.area_light >= kNoAreaLight &&
           traits.area_light < static_cast<std::int32_t>(scene.area_lights.size()) &&
           traits.motion >= kNoMotion &&
           traits.motion < static_cast<std::int32_t>(scene.motion.of_shapes.size()) &&
           (traits.motion == kNoMotion || traits.area_light == kNoAreaLight);
  };
  const auto is_unit = [](Vec3 v) { return std::abs(Length(v) - 1) < 1e-4F; };
  const auto is_light = [](Rgb c) { return IsFinite(c) && c.r >= 0 && c.g >= 0 && c.b >= 0; };
  const auto unsound_part_of = [&](const TriangleMesh& mesh) -> std::string {
    if (!traits_are_sound(mesh.traits)) return "the traits of a mesh";
    if (mesh.indices.empty() || mesh.indices.size() % 3 != 0) return "the indices of a mesh";
    for (const std::uint32_t index : mesh.indices) {
      if (index >= mesh.positions.size()) return "an index";
    }
    for (const Vec3 position : mesh.positions) {
      if (!IsFinite(position)) return "a position";
    }
    if (!mesh.normals.empty() && mesh.normals.size() != mesh.positions.size()) return "normals";
    if (!mesh.uvs.empty() && mesh.uvs.size() != mesh.positions.size()) return "uvs";
    for (const Vec2 uv : mesh.uvs) {
      if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) return "a uv";
    }
    for (const Vec3 normal : mesh.normals) {
      if (normal != Vec3() && !is_unit(normal)) return "a normal";
    }
    return "";
  };
  for (const std::vector<TriangleMesh>* list : {&scene.meshes, &scene.object_meshes}) {
    for (const TriangleMesh& mesh : *list) {
      if (std::string part = unsound_part_of(mesh); !part.empty()) return part;
    }
  }
  for (const TriangleMesh& mesh : scene.object_meshes) {
    if (mesh.traits.area_light != kNoAreaLight) return "the light of an object";
  }
  for (const InstancedObject& object : scene.objects) {
    if (std::size_t{object.first_mesh} + object.mesh_count > scene.object_meshes.size()) {
      return "an object";
    }
  }
  for (const Instance& instance : scene.instances) {
    if (instance.object >= scene.objects.size() || !instance.to_world.Inverse().ok() ||
        instance.motion < kNoMotion ||
        instance.motion >= static_cast<std::int32_t>(scene.motion.of_shapes.size())) {
      return "an instance";
    }
  }
  for (const CurvePiece& piece : scene.curve_pieces) {
    if (!traits_are_sound(piece.traits) || !IsFinite(piece.from) || !IsFinite(piece.to) ||
        !IsFinite(piece.center) || !(piece.from_radius >= 0) || !(piece.to_radius >= 0) ||
        !(piece.Reach() > 0) || !std::isfinite(piece.Reach()) ||
        piece.traits.area_light != kNoAreaLight) {
      return "a piece of a curve";
    }
  }
  for (const Sphere& sphere : scene.spheres) {
    if (!traits_are_sound(sphere.traits) || !IsFinite(sphere.center) || !(sphere.radius > 0) ||
        !std::isfinite(sphere.radius)) {
      return "a sphere";
    }
  }
  for (const Disk& disk : scene.disks) {
    if (!traits_are_sound(disk.traits) || !IsFinite(disk.center) || !is_unit(disk.normal) ||
        !(disk.radius > disk.inner_radius) || !(disk.inner_radius >= 0) ||
        !std::isfinite(disk.radius)) {
      return "a disk";
    }
  }
  for (const Material& material : scene.materials) {
    for (int c = 0; c < 3; ++c) {
      if (!(material.reflectance[c] >= 0 && material.reflectance[c] <= 1)) return "a reflectance";
      if (!(material.eta[c] > 0) || !(material.k[c] >= 0)) return "a metal";
    }
    if (!(material.ior > 0) || !(material.alpha_u >= 0) || !(material.alpha_v >= 0) ||
        (material.alpha_u == 0) != (material.alpha_v == 0)) {
      return "a material";
    }
    for (const std::int32_t texture :
         {material.texture, material.second_texture, material.roughness_textures[0],
          material.roughness_textures[1], material.roughness_textures[2],
          material.roughness_textures[3], material.displacement, material.normal_map,
          material.amount_texture}) {
      if (texture < kNoTexture || texture >= static_cast<std::int32_t>(scene.textures.size()))
        return "the texture of a material";
    }
    for (const std::int32_t part : material.mixed) {
      if (material.kind == Material::Kind::kMix &&
          !(part >= 0 && part < static_cast<std::int32_t>(scene.materials.size()) &&
            material.mixed_properties != nullptr)) {
        return "a mix";
      }
    }
  }
  for (std::size_t i = 0; i < scene.textures.size(); ++i) {
    const Texture& texture = scene.textures[i];
    const bool is_picture = texture.kind == Texture::Kind::kPicture;
    if (is_picture && (texture.picture == nullptr || !PictureIsSound(*texture.picture))) {
      return "the picture of a texture";
    }
    for (const std::int32_t part : texture.parts) {
      if (part < kNoTexture || part >= static_cast<std::int32_t>(i)) return "a part of a texture";
    }
    if (!std::isfinite(texture.scale)) return "the scale of a texture";
    for (const Vec2 uv : {Vec2{0, 0}, Vec2{0.3F, 17}, Vec2{-3e38F, 3e38F}}) {
      const auto number = static_cast<std::int32_t>(i);
      const TexturePlace place = {uv, {uv.y, 0, uv.x}, {0, 0, 1}};
      const Rgb color = TextureColor(scene.textures, number, place);
      if (!std::isfinite(TextureNumber(scene.textures, number, place)))
        return "the number of a texture";
      for (int c = 0; c < 3; ++c) {
        if (!(color[c] >= 0 && color[c] <= 1)) return "the colour of a texture";
      }
    }
  }
  for (const AreaLight& light : scene.area_lights) {
    if (!is_light(light.radiance) || !is_light(light.Largest())) return "an area light";
    if (light.picture != nullptr && !PictureIsSound(*light.picture))
      return "the picture of a light";
  }
  for (const PointLight& light : scene.point_lights) {
    if (!is_light(light.intensity) || !IsFinite(light.position)) return "a point light";
  }
  for (const SpotLight& light : scene.spot_lights) {
    if (!is_light(light.intensity) || !IsFinite(light.position) || !is_unit(light.direction)) {
      return "a spot light";
    }
  }
  for (const DistantLight& light : scene.distant_lights) {
    if (!is_light(light.irradiance) || !is_unit(light.direction)) return "a distant light";
  }
  for (const InfiniteLight& light : scene.infinite_lights) {
    if (!is_light(light.radiance)) return "an infinite light";
    if (light.map != nullptr &&
        (light.map->width != light.map->height || !PictureIsSound(*light.map) ||
         !is_unit(light.axes.x) || !is_unit(light.axes.y) || !is_unit(light.axes.z))) {
      return "an environment";
    }
    if (light.portal.has_value() != (light.kind == InfiniteLight::Kind::kPortal)) return "a portal";
    if (light.portal &&
        !(IsFinite(light.portal->corner) && LengthSquared(light.portal->along_x) > 0 &&
          LengthSquared(light.portal->along_y) > 0 &&
          std::isfinite(LengthSquared(light.portal->along_x)) &&
          std::isfinite(LengthSquared(light.portal->along_y)))) {
      return "a portal's sides";
    }
  }
  if (scene.motion.Moves()) {
    const double open = scene.motion.shutter_open;
    const double close = scene.motion.shutter_close;
    if (!(open < close)) return "the shutter";
    Scene moved = scene;
    const SceneMover mover(scene);
    for (const double share : {0.3, 1.0}) {
      mover.MoveTo(open + share * (close - open), moved);
      if (!moved.camera.camera_to_world.IsFinite()) return "a camera that moves";
      const Bounds box = BoundsOf(moved);
      if (!box.empty() && (!IsFinite(box.low) || !IsFinite(box.high))) return "what moves";
    }
  }
  const FilmSettings& film = scene.film;
  if (!(0 <= film.crop_x0 && film.crop_x0 < film.crop_x1 && film.crop_x1 <= film.width &&
        0 <= film.crop_y0 && film.crop_y0 < film.crop_y1 && film.crop_y1 <= film.height)) {
    return "the crop window";
  }
  if (!scene.camera.camera_to_world.IsFinite()) return "the camera";
  if (scene.sensors.empty() == (scene.camera.kind == Camera::Kind::kSensors)) return "no sensors";
  for (const Sensor& sensor : scene.sensors) {
    if (!IsFinite(sensor.position) || !is_unit(sensor.normal) || !(sensor.spacing > 0))
      return "a sensor";
  }
  const std::size_t buckets = scene.sensor_buckets.size();
  if (buckets != 0 && buckets != scene.sensors.size()) return "how many buckets there are";
  for (const SensorBucket& bucket : scene.sensor_buckets) {
    const auto& [a, b, c] = bucket.corners;
    if (!IsFinite(a) || !IsFinite(b) || !IsFinite(c) || !IsFinite(bucket.ball_center) ||
        !std::isfinite(bucket.ball_radius)) {
      return "a bucket of sensors";
    }
  }
  for (const auto& [a, b] : scene.sensor_borders) {
    if (!IsFinite(a) || !IsFinite(b)) return "a border of sensors";
  }
  return "";
}

}  // namespace lucerna
