"""Makes a small room in Blender and exports it as glTF for Lucerna.

  blender --background --factory-startup --python room.py -- room.glb

A glass sphere and a metal one in a box that is open to the front, under an area light: the glass
gathers its light into a caustic on the floor. In a scene of your own the last function is all that
you need.
"""
import sys

import bpy


def material(name, **inputs):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    for key, value in inputs.items():
        shader.inputs[key.replace("_", " ")].default_value = value
    return made


def solid_glass(name, ior, thickness_m):
    """Glass with an inside. Without a thickness glTF's glass is a sheet that bends no light."""
    made = material(name, Transmission=1.0, Roughness=0.0, IOR=ior, Base_Color=(1, 1, 1, 1))
    # The exporter looks for a group of this name; nothing of it is rendered in Blender.
    group = bpy.data.node_groups.get("glTF Material Output")
    if group is None:
        group = bpy.data.node_groups.new("glTF Material Output", "ShaderNodeTree")
        group.inputs.new("NodeSocketFloat", "Thickness")
    node = made.node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.inputs["Thickness"].default_value = thickness_m
    return made


def emitter(name, strength):
    """A surface that emits [W/(m² sr)]: area lights are not exported, emitting surfaces are."""
    made = material(name, Base_Color=(0, 0, 0, 1))
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Emission"].default_value = (1, 0.9, 0.75, 1)
    shader.inputs["Emission Strength"].default_value = strength
    return made


def plane(name, size, location, rotation, of):
    bpy.ops.mesh.primitive_plane_add(size=size, location=location, rotation=rotation)
    made = bpy.context.object
    made.name = name
    made.data.materials.append(of)
    return made


def sphere(name, radius, location, of):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=radius, location=location)
    made = bpy.context.object
    made.name = name
    bpy.ops.object.shade_smooth()
    made.data.materials.append(of)


def build():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    white = material("white", Base_Color=(0.75, 0.75, 0.75, 1), Roughness=1.0, Specular=0.0)
    red = material("red", Base_Color=(0.6, 0.08, 0.06, 1), Roughness=1.0, Specular=0.0)
    green = material("green", Base_Color=(0.1, 0.45, 0.12, 1), Roughness=1.0, Specular=0.0)
    half = 1.5707963
    plane("floor", 2, (0, 0, 0), (0, 0, 0), white)
    plane("ceiling", 2, (0, 0, 2), (2 * half, 0, 0), white)
    plane("back", 2, (0, 1, 1), (half, 0, 0), white)
    plane("left", 2, (-1, 0, 1), (0, half, 0), red)
    plane("right", 2, (1, 0, 1), (0, -half, 0), green)
    plane("lamp", 0.3, (0, 0, 1.99), (2 * half, 0, 0), emitter("lamp", 120))
    sphere("glass", 0.35, (0.4, -0.25, 0.5), solid_glass("glass", 1.5, 0.7))
    sphere("metal", 0.35, (-0.42, 0.3, 0.36),
           material("metal", Base_Color=(0.9, 0.7, 0.4, 1), Metallic=1.0, Roughness=0.15))
    bpy.ops.object.camera_add(location=(0, -3.6, 1), rotation=(half, 0, 0))
    camera = bpy.context.object
    camera.data.angle = 0.7
    bpy.context.scene.camera = camera
    bpy.context.scene.render.resolution_x = 720
    bpy.context.scene.render.resolution_y = 720


def export(path):
    bpy.ops.export_scene.gltf(filepath=path, export_format="GLB", export_cameras=True,
                              export_lights=True, export_apply=True)


if __name__ == "__main__":
    arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    build()
    export(arguments[0] if arguments else "room.glb")
