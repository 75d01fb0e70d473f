"""The add-on: File > Export > Baton job, Render > Submit to Baton.

Both save a copy of the file and export that in a Blender of its own (headless.py), so the open file stays as it is."""

import shutil
import subprocess
import tempfile
from pathlib import Path

import bpy

from .folders import new_numbered

bl_info = {
    "name": "Baton jobs",
    "author": "Baton",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "location": "File > Export > Baton job; Render > Submit to Baton",
    "description": "Exports shots that are lit by HDR maps as Baton jobs, and submits them to a farm",
    "category": "Import-Export",
}
HEADLESS = Path(__file__).resolve().parent / "headless.py"
OK, NOT_CARRIED = 0, 1


class Failed(Exception):
    """What a program said when it failed."""


def run(command):
    try:
        return subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    except OSError as fault:
        raise Failed(f"{command[0]}: {fault.strerror}") from None


def export_copy(folder, strict):
    """Exports the open file as it is now; whether a job was written, and the report."""
    name = Path(bpy.data.filepath).name or "untitled.blend"
    with tempfile.TemporaryDirectory(prefix="baton-") as scratch:
        copy = str(Path(scratch) / name)
        bpy.ops.wm.save_as_mainfile(filepath=copy, copy=True)
        done = run([bpy.app.binary_path, "-b", copy, "-P", HEADLESS, "--", folder] + ["--strict"] * strict)
    report = folder / "report.txt"
    if done.returncode not in (OK, NOT_CARRIED):
        raise Failed((done.stderr.strip() or done.stdout.strip()).splitlines()[-1])
    return done.returncode == OK, report.read_text(encoding="utf-8")


def show(operator, report):
    """In the status bar, and as the text "Baton report"."""
    text = bpy.data.texts.get("Baton report") or bpy.data.texts.new("Baton report")
    text.from_string(report)
    lines = report.splitlines()
    for line in lines:
        operator.report({"INFO"} if len(lines) == 1 else {"WARNING"}, line)


class ExportJob(bpy.types.Operator):
    """Write this shot as a job for Baton: a folder with job.json, geometry, images and a report"""
    bl_idname = "export_scene.baton"
    bl_label = "Export Baton job"

    directory: bpy.props.StringProperty(name="Folder", subtype="DIR_PATH")
    strict: bpy.props.BoolProperty(name="Strict", description="Write no job where something is not carried over")

    def invoke(self, context, _event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, _context):
        try:
            written, report = export_copy(Path(bpy.path.abspath(self.directory)), self.strict)
        except Failed as fault:
            self.report({"ERROR"}, str(fault))
            return {"CANCELLED"}
        show(self, report)
        return {"FINISHED"} if written else {"CANCELLED"}


class SubmitJob(bpy.types.Operator):
    """Export this shot and hand it over to Baton's coordinator"""
    bl_idname = "render.submit_to_baton"
    bl_label = "Submit to Baton"

    def execute(self, context):
        chosen = context.preferences.addons[__name__].preferences
        if chosen.folder.startswith("//") and not bpy.data.filepath:
            self.report({"ERROR"}, "save the file first: jobs go beside it")
            return {"CANCELLED"}
        try:
            folder = new_numbered(Path(bpy.path.abspath(chosen.folder)) / (Path(bpy.data.filepath).stem or "untitled"))
        except OSError as fault:
            self.report({"ERROR"}, f"{fault.filename}: {fault.strerror}")
            return {"CANCELLED"}
        command = [bpy.path.abspath(chosen.program), "job", "submit", folder / "job.json", "--coordinator", chosen.coordinator]
        if chosen.key:
            command += ["--key", bpy.path.abspath(chosen.key)]
        try:
            written, report = export_copy(folder, chosen.strict)
            show(self, report)
            if not written:
                shutil.rmtree(folder, ignore_errors=True)
                return {"CANCELLED"}
            done = run(command)
            if done.returncode:
                raise Failed(done.stderr.strip() or f"{chosen.program}: exit code {done.returncode}")
        except Failed as fault:
            self.report({"ERROR"}, str(fault))
            return {"CANCELLED"}
        self.report({"INFO"}, f"submitted: {done.stdout.strip()}")
        return {"FINISHED"}


class Preferences(bpy.types.AddonPreferences):
    bl_idname = __name__

    coordinator: bpy.props.StringProperty(name="Coordinator", default="tcp://127.0.0.1:5570")
    key: bpy.props.StringProperty(name="Key", description="user.key, where the farm asks for one", subtype="FILE_PATH")
    program: bpy.props.StringProperty(name="Program", description="Where `baton` is", default="baton", subtype="FILE_PATH")
    folder: bpy.props.StringProperty(name="Folder", description="Where submitted jobs go: on the farm's shared file system",
                                     default="//baton", subtype="DIR_PATH")
    strict: bpy.props.BoolProperty(name="Strict", description="Submit no job where something is not carried over")

    def draw(self, _context):
        for name in ("coordinator", "key", "program", "folder", "strict"):
            self.layout.prop(self, name)


def export_entry(menu, _context):
    menu.layout.operator(ExportJob.bl_idname, text="Baton job")


def submit_entry(menu, _context):
    menu.layout.operator(SubmitJob.bl_idname)


CLASSES = (Preferences, ExportJob, SubmitJob)


def register():
    for item in CLASSES:
        bpy.utils.register_class(item)
    bpy.types.TOPBAR_MT_file_export.append(export_entry)
    bpy.types.TOPBAR_MT_render.append(submit_entry)


def unregister():
    bpy.types.TOPBAR_MT_render.remove(submit_entry)
    bpy.types.TOPBAR_MT_file_export.remove(export_entry)
    for item in reversed(CLASSES):
        bpy.utils.unregister_class(item)
