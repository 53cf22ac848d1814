"""Teaching: teachers that see everything and follow any reference, what they focus on, and whom they teach."""

from tracking.teaching.focus import Focus, focus, judge_teacher
from tracking.teaching.teach import teach, teach_tracker
from tracking.teaching.teacher import TeacherTrainer, teacher_actions, teaching_task
from tracking.teaching.teacher_file import Teacher, load_teacher, restore_teacher, save_teacher, teacher_actor
from tracking.teaching.who_teaches import find_teacher, judge_tracker

__all__ = [
    "Focus",
    "Teacher",
    "TeacherTrainer",
    "find_teacher",
    "focus",
    "judge_teacher",
    "judge_tracker",
    "load_teacher",
    "restore_teacher",
    "save_teacher",
    "teach",
    "teach_tracker",
    "teacher_actions",
    "teacher_actor",
    "teaching_task",
]
